"""Arguments that would fail later, in another thread: refused where they are given."""

from __future__ import annotations

import math

from actionlib_core.exceptions import ActionlibError, DurationTypeError, InvalidDurationError
from actionlib_core.time import to_seconds


def check_functions(where: str, **callbacks: object) -> None:
    """Refuse callbacks, given by their names, that cannot be called; see `check_function`."""
    for argument, value in callbacks.items():
        if value is not None and not callable(value):
            check_function(where, argument, value)


def check_function(where: str, argument: str, value: object) -> None:
    """Refuse a callback that cannot be called; None is one that is not wanted.

    Args:
        where: Whose callback, "action 'dock'" for example.
        argument: Its name.
        value: What was given.

    Raises:
        ActionlibError: it is no function.
    """
    if value is not None and not callable(value):
        raise ActionlibError(
            f"{where}: {argument}: got {value!r}; expected a function. Try giving the function "
            "itself, without calling it."
        )


def check_class(where: str, value: object, attribute: str, kind: str) -> None:
    """Refuse what is not an interface class of the right kind.

    Args:
        where: For what, "service 'open'" for example.
        value: What was given.
        attribute: What classes of this kind have.
        kind: What they are called, for the error.

    Raises:
        ActionlibError: it is none.
    """
    if not isinstance(value, type) or not hasattr(value, attribute):
        raise ActionlibError(f"{where}: got {value!r}; expected a {kind}.")


def check_queue_size(where: str, value: object) -> None:
    """Refuse a queue size that is no number; None and, as in rospy, 0 set no limit.

    Raises:
        ActionlibError: it is none, or negative.
    """
    if value is not None and (not isinstance(value, int) or value < 0):
        raise ActionlibError(
            f"{where}: queue_size: got {value!r}; expected a number of messages, or None for no "
            "limit."
        )


SECONDS = "seconds, 0 or more, as a number or a Duration"


def check_seconds(where: str, argument: str, value: object) -> float:
    """Return a time that has an end, as a number; refuse what is none.

    Args:
        where: Whose, "action 'dock'" for example.
        argument: Its name.
        value: What was given: seconds as a number or a `Duration`.

    Raises:
        DurationTypeError: it is neither.
        InvalidDurationError: it is negative or NaN, or has no end.
    """
    seconds = check_limit(where, argument, value)
    if seconds is None:
        kind = DurationTypeError if value is None else InvalidDurationError
        raise kind(where, argument, value, SECONDS)
    return seconds


def check_limit(where: str, argument: str, value: object) -> float | None:
    """Return the longest time for something; None, or infinity, sets no limit. As `check_seconds`.

    Raises:
        DurationTypeError: it is no time.
        InvalidDurationError: it is negative or NaN.
    """
    seconds = _check_number(where, argument, value)
    if seconds is not None and seconds < 0:
        raise InvalidDurationError(where, argument, value, SECONDS)
    return seconds


def check_delay(where: str, argument: str, value: object) -> float | None:
    """As `check_limit`, for a wait, often the rest of a time: a negative one is over, as 0 is.

    Raises:
        DurationTypeError: it is no time.
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
    """As `check_delay`, by actionlib's rule: 0 sets no limit, too."""
    seconds = _check_number(where, argument, value)
    return max(seconds, 0.0) if seconds else None
