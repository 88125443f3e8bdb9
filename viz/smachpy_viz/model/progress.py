"""Reads a goal's progress from its feedback, for any action with the usual field names.

Goals and feedback are user-defined messages, or records of them, so no field is required: missing
or unreadable fields are skipped.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from smachpy.userdata.shown import fields_of
from smachpy_viz.model.labels import shorten

DISTANCES = ("distance_remaining", "distance_left", "distance_to_goal", "distance")
FRACTIONS = ("progress", "fraction", "completion")
PERCENTS = ("percent", "percent_complete", "percentage")
TIMES = ("seconds_left", "time_left", "time_remaining", "estimated_time_remaining")
COUNTS = ("remaining", "left", *TIMES)
TEXTS = ("text", "message", "status", "state", "phase")
TEXT_LENGTH = 60
MIN_FRACTION = 0.05
"""The remaining time is estimated only after this fraction: earlier it is too uncertain."""
MIN_SECONDS = 1.0
"""The remaining time is estimated only this long after the goal was sent [s]."""


@dataclass(frozen=True, slots=True)
class GoalProgress:
    """The progress of a running goal.

    Attributes:
        fraction: 0 to 1; None if unknown.
        distance: Remaining distance [m]; None if unknown.
        text: The feedback in words; may be empty.
    """

    fraction: float | None = None
    distance: float | None = None
    text: str = ""


def progress_of(goal: Any, feedback: Any, first: Any) -> GoalProgress:
    """Return a running goal's progress.

    Args:
        goal: The goal.
        feedback: Its newest feedback; None before the first one.
        first: Its first feedback; progress is measured from it.
    """
    if feedback is None:
        return GoalProgress()
    distance = _distance(goal, feedback)
    return GoalProgress(_fraction(goal, feedback, first, distance), distance, _text(feedback))


def seconds_left(feedback: Any, fraction: float | None, passed: float) -> float | None:
    """Return the remaining time of a running goal [s]: from its server, or else estimated.

    Args:
        feedback: Its newest feedback.
        fraction: Its progress, 0 to 1; None if unknown.
        passed: Time since it was sent [s].
    """
    said = _first(feedback, TIMES)
    if said is not None:
        return max(said, 0.0)
    if fraction is None or fraction < MIN_FRACTION or passed < MIN_SECONDS:
        return None
    return passed * (1.0 - fraction) / fraction


@dataclass(frozen=True, slots=True)
class Written:
    """The progress that the mission itself reports: a value that a state wrote to userdata.

    Attributes:
        fraction: 0 to 1; None if there is no end.
        seconds_left: Remaining time [s]; None if unknown.
        text: Where it is.
    """

    fraction: float | None
    seconds_left: float | None
    text: str


def written_progress(value: Any) -> Written | None:
    """Return a value with the attributes `fraction`, `seconds_left` and `text`; else None."""
    text = _read(value, "text")
    if not (isinstance(text, str) and {"fraction", "seconds_left"} <= {*_names(value)}):
        return None
    fraction, seconds = _number(_read(value, "fraction")), _number(_read(value, "seconds_left"))
    if fraction is not None:
        fraction = min(max(fraction, 0.0), 1.0)
    return Written(fraction, seconds, shorten(text, TEXT_LENGTH))


def _distance(goal: Any, feedback: Any) -> float | None:
    said = _first(feedback, DISTANCES)
    if said is not None:
        return said
    base, target = _read(feedback, "base_position"), _read(goal, "target_pose")
    # No distance field: move_base's feedback has the robot's pose, so measure to the goal.
    here, there = _position(base), _position(target)
    if here is None or there is None or _frame(base) != _frame(target):
        return None
    return math.hypot(there[0] - here[0], there[1] - here[1])


def _frame(stamped: Any) -> Any:
    """Return the frame of a pose; a distance between two frames would be meaningless."""
    frame = _read(_read(stamped, "header"), "frame_id")
    return frame.removeprefix("/") if isinstance(frame, str) else frame


def _position(stamped: Any) -> tuple[float, float] | None:
    position = _read(_read(stamped, "pose"), "position")
    x, y = _number(_read(position, "x")), _number(_read(position, "y"))
    return None if x is None or y is None else (x, y)


def _fraction(goal: Any, feedback: Any, first: Any, distance: float | None) -> float | None:
    percent = _first(feedback, PERCENTS)
    said = _first(feedback, FRACTIONS) if percent is None else percent / 100
    if said is not None:
        return min(max(said, 0.0), 1.0)
    whole, left = _distance(goal, first), distance
    if whole is None or left is None:
        whole, left = _first(first, COUNTS), _first(feedback, COUNTS)
    if whole is None or left is None or whole <= 0:
        return None
    return min(max(1 - left / whole, 0.0), 1.0)


def _text(feedback: Any) -> str:
    for name in TEXTS:
        value = _read(feedback, name)
        if isinstance(value, str) and value:
            return shorten(value, TEXT_LENGTH)
    values = {name: _read(feedback, name) for name in _names(feedback)}
    texts = [value for value in values.values() if isinstance(value, str)]
    if len(texts) == 1 and " " in texts[0]:  # a whole phrase needs no field names
        return shorten(texts[0], TEXT_LENGTH)
    words = [
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in values.items()
        if isinstance(value, (int, float, str))
    ]
    return shorten(", ".join(words), TEXT_LENGTH)


def _names(message: Any) -> tuple[str, ...]:
    fields = fields_of(message)
    if fields is not None:
        return tuple(name for name in fields if isinstance(name, str) and name[:1] != "_")
    slots = getattr(type(message), "__slots__", ())
    names = (slots,) if isinstance(slots, str) else tuple(slots)
    return tuple(n for n in names or tuple(getattr(message, "__dict__", ())) if n[:1] != "_")


def _first(message: Any, names: tuple[str, ...]) -> float | None:
    return next((v for n in names if (v := _number(_read(message, n))) is not None), None)


def _read(message: Any, name: str) -> Any:
    fields = fields_of(message)
    if fields is not None:
        return fields.get(name)
    try:
        return getattr(message, name, None)
    except Exception:  # noqa: BLE001  a user's property may raise anything: the field is skipped
        return None


def _number(value: Any) -> float | None:
    """Return a number, or the seconds of a duration; None if it is not finite."""
    seconds = _read(value, "to_sec")
    if callable(seconds):
        value = seconds()
    elif (parts := fields_of(value)) is not None:  # a recorded duration
        secs, nsecs = parts.get("secs"), parts.get("nsecs")
        value = secs + nsecs / 1e9 if type(secs) is int and type(nsecs) is int else None
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value) if math.isfinite(value) else None
