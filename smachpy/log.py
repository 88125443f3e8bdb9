"""SMACH's four loggers, on top of the standard library's logger "smachpy".

By default messages go to `logging.getLogger("smachpy")`, so they are filtered and formatted by
`logging`. `set_loggers` sends them elsewhere.
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, NamedTuple

from smachpy.machines.problems import Problems

if TYPE_CHECKING:
    from collections.abc import Callable

_logger = logging.getLogger("smachpy")


class _Loggers(NamedTuple):
    info: Callable[[str], object]
    warn: Callable[[str], object]
    debug: Callable[[str], object]
    error: Callable[[str], object]


_STANDARD = _Loggers(_logger.info, _logger.warning, _logger.debug, _logger.error)
_current = [_STANDARD]


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
    given = _Loggers(info, warn, debug, error)
    _current[0] = _STANDARD if given == _STANDARD else given


def current_loggers() -> tuple[Callable[[str], object], ...]:
    """Return the functions in force, in the order in which `set_loggers` takes them."""
    return _current[0]


def loginfo(msg: str) -> None:
    """Log what the machine does."""
    _current[0].info(msg)


def logwarn(msg: str) -> None:
    """Log something that is probably not meant so."""
    _current[0].warn(msg)


def logerr(msg: str) -> None:
    """Log an error."""
    _current[0].error(msg)


def logdebug(msg: str) -> None:
    """Log details."""
    _current[0].debug(msg)


def is_info_wanted() -> bool:
    """Tell whether `loginfo` goes anywhere."""
    return _current[0] is not _STANDARD or _logger.isEnabledFor(logging.INFO)


def log_exception(msg: str, error: BaseException) -> None:
    """Log an error with the traceback of `error`."""
    if _current[0] is _STANDARD:
        _logger.error(msg, exc_info=error)
        return
    import traceback

    text = "".join(traceback.format_exception(error))
    _current[0].error(f"{msg}\n{text}")
