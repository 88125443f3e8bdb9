"""Waypoint lists: where a mission drives, read from YAML and checked against a map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from missions.checked_yaml import REQUIRED, Document, Limits
from missions.exceptions import NavigationError
from missions.move_base.geometry import Pose2D, wrap_angle

if TYPE_CHECKING:
    from pathlib import Path

    from missions.checked_yaml import Section
    from missions.move_base.planner import Planner

_SHARE: Final = Limits(low=0.0, high=1.0)


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A named place to drive to.

    Attributes:
        name: What to call it in logs and pictures.
        pose: In the map frame.
    """

    name: str
    pose: Pose2D


@dataclass(frozen=True, slots=True)
class Route:
    """What a patrol needs to know of a floor.

    Attributes:
        waypoints: Where to go, in this order.
        dock: Where the robot charges.
        low_battery: Drive to the dock below this charge, 0 to 1.
        charge_until: Leave the dock at this charge, 0 to 1.
    """

    waypoints: tuple[Waypoint, ...]
    dock: Waypoint
    low_battery: float
    charge_until: float


def load_route(path: Path, planner: Planner | None = None) -> Route:
    """Read a waypoint file.

    Args:
        path: The YAML file.
        planner: Of the floor the robot drives on, to find places where it cannot stand; None when
            the floor is not known here (then the robot's server refuses them).

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path)
    top = document.top
    low = top.number("low_battery", 0.3, _SHARE)
    until = top.number("charge_until", 0.9, _SHARE)
    if "charge_until" in top and until <= low:
        top.problem("charge_until", f"more than low_battery ({low:g})")
    dock = _waypoint(top.section("dock"), "dock", planner)
    waypoints = tuple(
        _waypoint(row, f"waypoint {i}", planner) for i, row in enumerate(top.rows("waypoints"), 1)
    )
    top.close()
    document.check()
    return Route(waypoints, dock, low, until)


def _waypoint(section: Section, default_name: str, planner: Planner | None) -> Waypoint:
    name = section.text("name", default_name)
    x = section.number("x", REQUIRED, unit="m")
    y = section.number("y", REQUIRED, unit="m")
    yaw = section.number("yaw", 0.0, unit="rad")
    section.close()
    if planner is not None and "x" in section and "y" in section:
        try:
            planner.check_goal((x, y))
        except NavigationError as error:
            reason = str(error).removeprefix("goal ")
            section.problem("x", "a place where the robot can stand", f"{name}: {reason}.")
    return Waypoint(name, Pose2D(x, y, wrap_angle(yaw)))
