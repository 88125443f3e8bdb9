"""Waypoint lists: where a mission drives, read from YAML and checked against the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Header
from missions.checked_yaml import REQUIRED, Document, Limits
from missions.exceptions import NavigationError
from missions.move_base.config import SimConfig, load_config
from missions.move_base.geometry import Pose2D, quaternion_of, wrap_angle

if TYPE_CHECKING:
    from pathlib import Path

    from missions.checked_yaml import Section
    from missions.move_base.floor import Floor

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

    def goal(self) -> MoveBaseGoal:
        """Return the `move_base` goal that drives here."""
        return goal_at(self.pose)


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


def goal_at(pose: Pose2D, frame: str = "map") -> MoveBaseGoal:
    """Return the `move_base` goal that drives to a pose in the frame "map" or "base_link"."""
    turn = Quaternion(*quaternion_of(pose.yaw))
    there = Pose(position=Point(pose.x, pose.y, 0.0), orientation=turn)
    return MoveBaseGoal(target_pose=PoseStamped(header=Header(frame_id=frame), pose=there))


def load_route(path: Path) -> Route:
    """Read a waypoint file.

    With the field `map` (and `robot`, for its radius) every place is checked against that floor;
    without it only the robot's server can refuse places where the robot cannot stand.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path)
    top = document.top
    floor = _floor(top, path)
    low = top.number("low_battery", 0.3, _SHARE)
    until = top.number("charge_until", 0.9, _SHARE)
    if "charge_until" in top and until <= low:
        top.problem("charge_until", f"more than low_battery ({low:g})")
    dock = _waypoint(top.section("dock"), "dock", floor)
    waypoints = tuple(
        _waypoint(row, f"waypoint {i}", floor) for i, row in enumerate(top.rows("waypoints"), 1)
    )
    top.close()
    document.check()
    return Route(waypoints, dock, low, until)


def _floor(top: Section, path: Path) -> Floor | None:
    """Return the floor that the file names, inflated by its robot."""
    robot = SimConfig()
    if "robot" in top:
        robot = load_config(path.parent / top.text("robot", REQUIRED))
    if "map" not in top:
        return None
    from missions.move_base.floor import Floor
    from missions.move_base.occupancy import load_map

    grid = load_map(path.parent / top.text("map", REQUIRED))
    return Floor(grid, robot.robot.radius, robot.planner)


def _waypoint(section: Section, default_name: str, floor: Floor | None) -> Waypoint:
    name = section.text("name", default_name)
    x = section.number("x", REQUIRED, unit="m")
    y = section.number("y", REQUIRED, unit="m")
    yaw = section.number("yaw", 0.0, unit="rad")
    section.close()
    if floor is not None and "x" in section and "y" in section:
        try:
            floor.check_place(x, y)
        except NavigationError as error:
            reason = str(error).removeprefix("goal ")
            section.problem("x", "a place where the robot can stand", f"{name}: {reason}.")
    return Waypoint(name, Pose2D(x, y, wrap_angle(yaw)))
