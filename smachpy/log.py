"""SMACH's four loggers, on top of the standard library's logger "smachpy".

By default messages go to `logging.getLogger("smachpy")`, so they are filtered and formatted by
`logging`. `set_loggers` sends them elsewhere.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from smachpy.machines.problems import Problems

if TYPE_CHECKING:
    from collections.abc import Callable

_logger = logging.getLogger("smachpy")


_STANDARD = (_logger.info, _logger.warning, _logger.debug, _logger.error)


class Messages:
    """The functions for messages in force; what runs machines calls them directly.

    Attributes:
        logger: The standard library's logger, to which messages go by default.
        are_own: They go to functions of the program instead.
    """

    __slots__ = ("are_own", "debug", "error", "info", "logger", "warn")

    def __init__(self) -> None:
        self.use(_STANDARD)

    def use(self, functions: tuple[Callable[[str], object], ...]) -> None:
        """Send messages to these from now on."""
        self.info, self.warn, self.debug, self.error = functions
        self.are_own = functions != _STANDARD
        self.logger = _logger

    def all(self) -> tuple[Callable[[str], object], ...]:
        """Return them, in the order in which `set_loggers` takes them."""
        return self.info, self.warn, self.debug, self.error


MESSAGES = Messages()


def set_loggers(
    info: Callable[[str], object],
    warn: Callable[[str], object],
    debug: Callable[[str], object],
    error: Callable[[str], object],
) -> None:
    """Send the four kinds of messages to these functions; mind the order of the arguments.

    Raises:
        InvalidStateError: one of them cannot be called.
    """
    problems = Problems("set_loggers")
    for name, function in (("info", info), ("warn", warn), ("debug", debug), ("error", error)):
        problems.function(name, function, f"{name}(text)", 1, optional=False)
    problems.raise_all()
    MESSAGES.use((info, warn, debug, error))


def current_loggers() -> tuple[Callable[[str], object], ...]:
    """Return the functions in force, in the order in which `set_loggers` takes them."""
    return MESSAGES.all()


def loginfo(msg: str) -> None:
    """Log what the machine does."""
    MESSAGES.info(msg)


def logwarn(msg: str) -> None:
    """Log something that is probably not meant so."""
    MESSAGES.warn(msg)


def logerr(msg: str) -> None:
    """Log an error."""
    MESSAGES.error(msg)


def logdebug(msg: str) -> None:
    """Log details."""
    MESSAGES.debug(msg)


def log_exception(msg: str, error: BaseException) -> None:
    """Log an error with the traceback of `error`."""
    if not MESSAGES.are_own:
        _logger.error(msg, exc_info=error)
        return
    import traceback

    text = "".join(traceback.format_exception(error))
    MESSAGES.error(f"{msg}\n{text}")
