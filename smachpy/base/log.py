"""SMACH's four loggers, on top of the standard library's logger "smachpy".

By default messages go to `logging.getLogger("smachpy")`, so they are filtered and formatted by
`logging`. `set_loggers` sends them elsewhere.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from smachpy.base.problems import Problems

if TYPE_CHECKING:
    from collections.abc import Callable

_logger = logging.getLogger("smachpy")


_STANDARD = (_logger.info, _logger.warning, _logger.debug, _logger.error)


class Messages:
    """The current functions for messages; the library calls them directly.

    Attributes:
        logger: The standard library's logger, the default.
        are_own: The functions are the program's own.
    """

    __slots__ = ("are_own", "debug", "error", "info", "logger", "warn")

    def __init__(self) -> None:
        self.use(_STANDARD)

    def use(self, functions: tuple[Callable[[str], object], ...]) -> None:
        """Set the functions."""
        self.info, self.warn, self.debug, self.error = functions
        self.are_own = functions != _STANDARD
        self.logger = _logger

    def all(self) -> tuple[Callable[[str], object], ...]:
        """Return them in the order of the arguments of `set_loggers`."""
        return self.info, self.warn, self.debug, self.error


MESSAGES = Messages()


def set_loggers(
    info: Callable[[str], object],
    warn: Callable[[str], object],
    debug: Callable[[str], object],
    error: Callable[[str], object],
) -> None:
    """Set the functions for the four kinds of messages; note the order of the arguments.

    Each is called with a text.

    Raises:
        InvalidStateError: one of them cannot be called.

    Threads: they are called in the thread that has something to say, also several at once.
    """
    problems = Problems("set_loggers")
    for name, function in (("info", info), ("warn", warn), ("debug", debug), ("error", error)):
        problems.function(name, function, f"{name}(text)", 1, optional=False)
    problems.raise_all()
    MESSAGES.use((info, warn, debug, error))


def current_loggers() -> tuple[Callable[[str], object], ...]:
    """Return the current functions in the order of the arguments of `set_loggers`."""
    return MESSAGES.all()


def loginfo(msg: str) -> None:
    """Log information about a run."""
    MESSAGES.info(msg)


def logwarn(msg: str) -> None:
    """Log a probable mistake."""
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
