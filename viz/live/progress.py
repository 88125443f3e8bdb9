"""Progress of goals whose messages have come as plain data."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from viz.feedback import progress_of
from viz.history import Goal


def annotate(record: dict[str, Any], goals: dict[str, Any]) -> dict[str, Any]:
    """Return `record`, with `progress` if it is feedback: fraction, distance [m] and text.

    Args:
        record: A record of an event.
        goals: The goals of `smachpy.run_state.RunState`, before that event.
    """
    if record["kind"] != "GoalFeedback" or "progress" in record:
        return record
    known = goals.get(record["goal_id"])
    if known is None:
        return record
    first = known["first_feedback"]
    progress = progress_of(
        Goal(
            record["path"],
            record["action"],
            record["goal_id"],
            0.0,
            _object(known["goal"]),
            _object(record["feedback"]),
            _object(record["feedback"] if first is None else first),
        )
    )
    shown = {
        "fraction": progress.fraction,
        "distance": progress.distance,
        "text": progress.text,
    }
    return {**record, "progress": shown}


def _object(data: Any) -> Any:
    """Plain data with its fields as attributes."""
    if not isinstance(data, dict):
        return data
    fields = data.get("fields", {}) if "$msg" in data else data
    if not isinstance(fields, dict):
        return None
    return SimpleNamespace(**{str(name): _object(value) for name, value in fields.items()})
