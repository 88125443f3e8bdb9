"""Where a goal leads, or what it is about, in a few words; pure.

Goals are messages of anybody: no field is required, and unreadable ones are skipped.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from smachpy.userdata.shown import fields_of
from smachpy_viz.model.labels import shorten

if TYPE_CHECKING:
    from collections.abc import Iterable

NAMES: Final = (
    "name",
    "station",
    "place",
    "waypoint",
    "location",
    "target",
    "object",
    "item",
    "text",
)
NEAR_M: Final = 0.3
"""A goal so near to a named place has its name."""

DEPTH: Final = 5


def destination(goal: Any, values: Iterable[Any] = ()) -> str:
    """Return the destination of a goal; "" if it cannot be said in a few words.

    Args:
        goal: The goal, as events tell it.
        values: Values of userdata, among which places with names may be.
    """
    place = _place(goal)
    if place is not None:
        for value in values:
            name, there = (fields_of(value) or {}).get("name"), _place(value)
            if isinstance(name, str) and there is not None and math.dist(place, there) < NEAR_M:
                return shorten(name, 24)
        return f"({place[0]:.1f}, {place[1]:.1f})"
    fields = fields_of(goal) or {}
    found = (fields[name] for name in NAMES if isinstance(fields.get(name), str) and fields[name])
    return shorten(next(found, ""), 24)


def _place(value: Any, depth: int = DEPTH) -> tuple[float, float] | None:
    """Return the first x and y in a value [m]."""
    fields = fields_of(value)
    if fields is None or not depth:
        return None
    x, y = fields.get("x"), fields.get("y")
    if isinstance(x, int | float) and isinstance(y, int | float):
        return float(x), float(y)
    return next((p for one in fields.values() if (p := _place(one, depth - 1)) is not None), None)
