"""What a mission needs of its robot: the actions that it calls."""

from __future__ import annotations

import posixpath
from typing import TYPE_CHECKING

from actionlib_core.names import clean_namespace

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.events.introspection import StateRecord


def needed_servers(record: StateRecord) -> dict[str, str]:
    """Return the actions that a machine's states call, and their types."""
    details = [dict(state.details) for state in record.walk() if state.kind == "action"]
    return {detail["action"]: detail["type"] for detail in details if "action" in detail}


def driven_robot(names: Iterable[str], robot: str | None) -> str | None:
    """Return the robot that a mission drives by the names of its actions, if that is not `robot`.

    Args:
        names: Full names, without a slash in front: "r1/move_base" drives r1, and so do
            "r1/arm/grip" and "r1/move_base" together.
        robot: The robot that it was given, or None.

    Returns:
        None if the names are those of no robot, of several, or of `robot`.
    """
    spaces = [name.rpartition("/")[0] for name in names if "/" in name]
    common = posixpath.commonpath(spaces) if spaces else ""
    if robot and f"{common}/".startswith(f"{clean_namespace(robot)}/"):
        return None
    return common or None
