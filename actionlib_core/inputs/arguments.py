"""Checks of arguments, so that a wrong one fails at the call and not later in another thread."""

from __future__ import annotations

import inspect
import math
from functools import partial
from types import CodeType
from typing import Any

from actionlib_core.exceptions import ActionlibError, DurationTypeError, InvalidDurationError
from actionlib_core.time import to_seconds

_MAKES_AN_OBJECT = inspect.CO_COROUTINE | inspect.CO_GENERATOR | inspect.CO_ASYNC_GENERATOR


def check_functions(where: str, **callbacks: object) -> None:
    """Check several callbacks by the names of their arguments; see `check_function`."""
    for argument, value in callbacks.items():
        if value is not None and not (callable(value) and _runs(value)):
            check_function(where, argument, value)


def check_function(where: str, argument: str, value: object) -> None:
    """Check that a callback can be called and that the call runs its body; None is allowed.

    Args:
        where: The owner, for the error: "action 'dock'".
        argument: The argument's name.
        value: The callback.

    Raises:
        ActionlibError: it cannot be called, or is an `async` function or a generator.
    """
    if value is None:
        return
    if not callable(value):
        raise ActionlibError(
            f"{where}: {argument}: got {value!r}; expected a function. Try giving the function "
            "itself, without calling it."
        )
    if not _runs(value):
        raise ActionlibError(
            f"{where}: {argument}: got {value!r}, an async function or a generator, whose body "
            "would not run; expected a function without async and yield. Try "
            "asyncio.run_coroutine_threadsafe() in it."
        )


def is_async(function: object) -> bool:
    """Return whether a call of a function makes a coroutine."""
    made: Any = function
    while isinstance(made, partial):
        made = made.func
    return inspect.iscoroutinefunction(made) or (
        callable(made) and inspect.iscoroutinefunction(type(made).__call__)
    )


def _runs(function: Any) -> bool:
    """Return whether a call runs the body: that of a coroutine or generator only makes an object.

    By the flags of its code, as goals are sent with callbacks and `inspect` is slower.
    """
    while isinstance(function, partial):
        function = function.func
    code = getattr(function, "__code__", None) or getattr(type(function).__call__, "__code__", None)
    return not (isinstance(code, CodeType) and code.co_flags & _MAKES_AN_OBJECT)


def is_goal_id(value: object) -> bool:
    """Return whether a goal may have this id: a string that is not empty and can be sent as UTF-8.

    Bytes of a command line that are no UTF-8 are lone surrogates in Python's string.
    """
    if not isinstance(value, str) or not value:
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def check_class(where: str, value: object, attribute: str, kind: str) -> None:
    """Check that a value is an interface class of the right kind.

    Args:
        where: The owner, for the error: "service 'open'".
        value: The value.
        attribute: An attribute that only classes of this kind have.
        kind: The kind, for the error.

    Raises:
        ActionlibError: it is not.
    """
    if not isinstance(value, type) or not hasattr(value, attribute):
        raise ActionlibError(f"{where}: got {value!r}; expected a {kind}.")


def check_queue_size(where: str, value: object) -> None:
    """Check that a queue size is a number, or None; 0, as in rospy, and None set no limit.

    Raises:
        ActionlibError: it is not, or negative.
    """
    if value is not None and (not isinstance(value, int) or value < 0):
        raise ActionlibError(
            f"{where}: queue_size: got {value!r}; expected a number of messages, or None for no "
            "limit."
        )


SECONDS = "seconds, 0 or more, as a number or a Duration"


def check_seconds(where: str, argument: str, value: object) -> float:
    """Return a finite duration in seconds.

    Args:
        where: The owner, for the error: "action 'dock'".
        argument: The argument's name.
        value: Seconds as a number, or a `Duration`.

    Raises:
        DurationTypeError: it is neither.
        InvalidDurationError: it is negative, NaN or infinite.
    """
    seconds = check_limit(where, argument, value)
    if seconds is None:
        kind = DurationTypeError if value is None else InvalidDurationError
        raise kind(where, argument, value, SECONDS)
    return seconds


def check_limit(where: str, argument: str, value: object) -> float | None:
    """Return a limit in seconds; None and infinity: no limit. Arguments as `check_seconds`.

    Raises:
        DurationTypeError: it is not a duration.
        InvalidDurationError: it is negative or NaN.
    """
    seconds = _check_number(where, argument, value)
    if seconds is not None and seconds < 0:
        raise InvalidDurationError(where, argument, value, SECONDS)
    return seconds


def check_delay(where: str, argument: str, value: object) -> float | None:
    """Return the length of a wait in seconds: a negative one is 0, None and infinity: no limit.

    Programs often pass the rest of a time, which may be negative by then.

    Raises:
        DurationTypeError: it is not a duration.
        InvalidDurationError: it is NaN.
    """
    seconds = _check_number(where, argument, value)
    return None if seconds is None else max(seconds, 0.0)


def _check_number(where: str, argument: str, value: object) -> float | None:
    if value is None:
        return None
    try:
        is_number = isinstance(value, (float, int))
        seconds = float(value if is_number else to_seconds(value))  # type: ignore[arg-type,call-overload]
    except (TypeError, ValueError):
        raise DurationTypeError(where, argument, value, SECONDS) from None
    if math.isnan(seconds):
        raise InvalidDurationError(where, argument, value, SECONDS)
    return None if seconds == math.inf else seconds


def check_wait(where: str, argument: str, value: object) -> float | None:
    """Return the length of a wait as `check_delay`, but 0 sets no limit either, as in actionlib."""
    seconds = _check_number(where, argument, value)
    return max(seconds, 0.0) if seconds else None
