"""Waypoint lists: where a mission drives, read from YAML or CSV and checked against the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Header
from actionlib_core.names import check_name
from missions.checked_yaml import REQUIRED, Document, Limits
from missions.exceptions import NavigationError
from missions.move_base.config import SimConfig, load_config
from missions.move_base.geometry import Pose2D, quaternion_of, wrap_angle

if TYPE_CHECKING:
    from pathlib import Path

    from missions.checked_yaml import Section
    from missions.move_base.floor import Floor
    from missions.move_base.occupancy import OccupancyMap

TASKS: Final = ("photo", "turn", "wait_for_service")
_SHARE: Final = Limits(low=0.0, high=1.0)
_SECONDS: Final = Limits(low=0.0)
_TURN: Final = Limits(low=-180.0, high=180.0)


@dataclass(frozen=True, slots=True)
class Task:
    """What to do at a waypoint.

    Attributes:
        kind: One of `TASKS`.
        angle: By how much to turn [deg], anticlockwise.
        service: The service to wait for.
    """

    kind: str
    angle: float = 0.0
    service: str = ""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """A named place to drive to.

    Attributes:
        name: What to call it in logs and pictures.
        pose: In the map frame.
        dwell: How long to stay there [s].
        task: What to do there after that.
    """

    name: str
    pose: Pose2D
    dwell: float = 0.0
    task: Task | None = None

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


@dataclass(frozen=True, slots=True)
class Tour:
    """Waypoints with what to do at each.

    Attributes:
        waypoints: Where to go, in this order.
        map: The floor, if the file names one.
    """

    waypoints: tuple[Waypoint, ...]
    map: OccupancyMap | None


@dataclass(frozen=True, slots=True)
class Place:
    """Where a delivery goes.

    Attributes:
        goal: The place itself.
        door: The name of the door that leads there; "" when there is none.
        wait: Where to stand until the door is open; None when there is none.
    """

    goal: Waypoint
    door: str = ""
    wait: Waypoint | None = None


@dataclass(frozen=True, slots=True)
class Places:
    """Where deliveries go.

    Attributes:
        home: Where the robot waits for orders and comes back to.
        places: The others, by name.
    """

    home: Waypoint
    places: dict[str, Place]


@dataclass(frozen=True, slots=True)
class Site:
    """Where a fleet works.

    Attributes:
        docks: Where robots charge.
        homes: Where they wait, one each.
        places: Where parcels come from and go to.
        low_battery: A robot below this charges before its next order, 0 to 1.
        charge_until: It leaves the dock at this charge, 0 to 1.
        map: The file of the floor; None when the file names none.
        robot: The file of the robots' parameters, likewise.
    """

    docks: tuple[Waypoint, ...]
    homes: tuple[Waypoint, ...]
    places: tuple[Waypoint, ...]
    low_battery: float
    charge_until: float
    map: Path | None = None
    robot: Path | None = None


def goal_at(pose: Pose2D, frame: str = "map") -> MoveBaseGoal:
    """Return the `move_base` goal that drives to a pose in the frame "map" or "base_link"."""
    turn = Quaternion(*quaternion_of(pose.yaw))
    there = Pose(position=Point(pose.x, pose.y, 0.0), orientation=turn)
    return MoveBaseGoal(target_pose=PoseStamped(header=Header(frame_id=frame), pose=there))


def load_route(path: Path) -> Route:
    """Read a patrol's waypoint file.

    With the field `map` (and `robot`, for its radius) every place is checked against that floor;
    without it only the robot's server can refuse places where the robot cannot stand.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path)
    top = document.top
    floor = _floor(top, path)
    low, until = _charges(top)
    dock = _place(top.section("dock"), "dock", floor)
    waypoints = tuple(
        _place(row, f"waypoint {i}", floor) for i, row in enumerate(top.rows("waypoints"), 1)
    )
    top.close()
    document.check()
    return Route(waypoints, dock, low, until)


def load_tour(path: Path, map_file: Path | None = None) -> Tour:
    """Read waypoints with their tasks, from YAML (the list `waypoints`) or CSV (a header line).

    Args:
        path: The file.
        map_file: The floor to check the waypoints against when the file has no field `map`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path, csv_rows="waypoints", csv_texts=("name", "task", "service"))
    top = document.top
    floor = _floor(top, path, map_file)
    waypoints = tuple(
        _stop(row, f"waypoint {i}", floor) for i, row in enumerate(top.rows("waypoints"), 1)
    )
    top.close()
    document.check()
    return Tour(waypoints, None if floor is None else floor.map)


def load_places(path: Path) -> Places:
    """Read the places that deliveries go to: `home`, and the list `places`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path)
    top = document.top
    floor = _floor(top, path)
    home = _place(top.section("home"), "home", floor)
    places: dict[str, Place] = {}
    for row in top.rows("places"):
        place = _behind_door(row, floor)
        if place.goal.name in places:
            row.problem("name", "a name that no other place has")
        places[place.goal.name] = place
    top.close()
    document.check()
    return Places(home, places)


def load_site(path: Path) -> Site:
    """Read where a fleet works: the lists `docks`, `homes` and `places`.

    Raises:
        InputFileError: with the line and field of every problem.
    """
    document = Document(path)
    top = document.top
    floor = _floor(top, path)
    low, until = _charges(top)
    docks, homes, places = (_named(top.rows(key), floor) for key in ("docks", "homes", "places"))
    files = (path.parent / top.text(key, "") if key in top else None for key in ("map", "robot"))
    top.close()
    document.check()
    return Site(docks, homes, places, low, until, *files)


def _named(rows: list[Section], floor: Floor | None) -> tuple[Waypoint, ...]:
    """Read places whose names differ."""
    found: dict[str, Waypoint] = {}
    for row in rows:
        row.text("name", REQUIRED)
        place = _place(row, "-", floor)
        if place.name in found:
            row.problem("name", "a name that no other place has")
        found[place.name] = place
    return tuple(found.values())


def _charges(top: Section) -> tuple[float, float]:
    """Read below which charge to charge, and up to which."""
    low = top.number("low_battery", 0.3, _SHARE)
    until = top.number("charge_until", 0.9, _SHARE)
    if "charge_until" in top and until <= low:
        top.problem("charge_until", f"more than low_battery ({low:g})")
    return low, until


def _floor(top: Section, path: Path, map_file: Path | None = None) -> Floor | None:
    """Return the floor that the file names, inflated by its robot."""
    robot = SimConfig()
    if "robot" in top:
        robot = load_config(path.parent / top.text("robot", REQUIRED))
    if "map" in top:
        map_file = path.parent / top.text("map", REQUIRED)
    if map_file is None:
        return None
    from missions.move_base.floor import Floor
    from missions.move_base.occupancy import load_map

    return Floor(load_map(map_file), robot.robot.radius, robot.planner)


def _place(section: Section, default_name: str, floor: Floor | None) -> Waypoint:
    """Read the name and the pose, and close the section."""
    name = section.text("name", default_name)
    found = section.problem_count
    x = section.number("x", REQUIRED, unit="m")
    y = section.number("y", REQUIRED, unit="m")
    known = section.problem_count == found
    yaw = section.number("yaw", 0.0, unit="rad")
    section.close()
    if floor is not None and known:
        try:
            floor.check_place(x, y)
        except NavigationError as error:
            reason = str(error).removeprefix("goal ")
            section.problem("x", "a place where the robot can stand", f"{name}: {reason}.")
    return Waypoint(name, Pose2D(x, y, wrap_angle(yaw)))


def _stop(row: Section, default_name: str, floor: Floor | None) -> Waypoint:
    """Read a waypoint with dwell time and task."""
    dwell = row.number("dwell", 0.0, _SECONDS, "s")
    task = _task(row)
    place = _place(row, default_name, floor)
    return Waypoint(place.name, place.pose, dwell, task)


def _task(row: Section) -> Task | None:
    angle = row.number("angle", 90.0, _TURN, "deg")
    service = _name(row, "service")
    found = row.problem_count
    kind = row.text("task", TASKS[0], TASKS)
    if row.problem_count > found:
        return None
    if "angle" in row and kind != "turn":
        row.problem("angle", "nothing, as the task is not 'turn'")
    if ("service" in row) != (kind == "wait_for_service"):
        row.problem("service", "the service of the task 'wait_for_service', and only of that")
    return Task(kind, angle, service) if "task" in row else None


def _behind_door(row: Section, floor: Floor | None) -> Place:
    """Read a place with the door that leads there."""
    row.text("name", REQUIRED)
    door = _name(row, "door")
    before = row.section("wait")
    wait = _place(before, "before the door", floor) if "wait" in row or door else None
    if wait is not None and not door:
        row.problem("wait", "a door to wait for", "Try: door: NAME.")
    return Place(_place(row, "-", floor), door, wait)


def _name(row: Section, key: str) -> str:
    """Read a name of the network; "" when it is not there."""
    if key not in row:
        row.text(key, "-")
        return ""
    name = row.text(key, REQUIRED)
    try:
        return check_name(name, key)
    except InvalidNameError as error:
        row.problem(key, "a name of the network", f"{error.reason}.")
        return "-"
