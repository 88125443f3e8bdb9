"""Reads world files: a map, robots, moving obstacles, doors and docks, in one YAML file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.names import check_base_name
from smachpy.sim.checked_yaml import REQUIRED, Document, Limits
from smachpy.sim.config import SimConfig, load_config
from smachpy.sim.exceptions import NavigationError
from smachpy.sim.floor import Floor, Obstacle
from smachpy.sim.geometry import Pose2D
from smachpy.sim.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.sim.occupancy import load_map
from smachpy.sim.world import Dock, Robot, World

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from smachpy.sim.checked_yaml import Section
    from smachpy.sim.occupancy import OccupancyMap

_SPEED: Final = Limits(above=0, high=10)
_RADIUS: Final = Limits(above=0, high=5)
_SECONDS: Final = Limits(low=0, high=600)
_CHARGE: Final = Limits(low=0, high=1)
_SHORTEST_DOOR: Final = 0.1  # [m]
_APART: Final = 0.5  # [m] between the bodies of robots that are placed automatically


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """A robot of a world.

    Attributes:
        name: Its namespace, one word.
        pose: Its start pose, in the map frame.
        config: Its parameters.
    """

    name: str
    pose: Pose2D
    config: SimConfig


@dataclass(frozen=True, slots=True)
class MoverSpec:
    """A moving obstacle of a world; see `Mover`."""

    name: str
    places: tuple[tuple[float, float], ...]
    radius: float
    speed: float
    loop: bool


@dataclass(frozen=True, slots=True)
class DoorSpec:
    """A door of a world; see `Door`."""

    name: str
    ends: tuple[float, float, float, float]
    seconds: float
    is_open: bool


@dataclass(frozen=True, slots=True)
class WorldSpec:
    """The initial state of a world.

    Attributes:
        name: Its name in messages: the file's name.
        grid: The map.
        robots: In the order of their right of way.
        movers: Moving obstacles.
        doors: Doors.
        docks: Docks for any robot.
    """

    name: str
    grid: OccupancyMap
    robots: tuple[RobotSpec, ...] = ()
    movers: tuple[MoverSpec, ...] = ()
    doors: tuple[DoorSpec, ...] = ()
    docks: tuple[Dock, ...] = ()

    def build(self, now: float) -> World:
        """Make the world at time `now` [s].

        Raises:
            NavigationError: a robot or moving obstacle cannot stand at its start.
        """
        world = World(self.grid)
        for robot in self.robots:
            try:
                Robot(world, robot.config, robot.pose, now, robot.name)
            except NavigationError as error:
                raise NavigationError(f"{self.name}: {robot.name}: {error}") from error
        for mover in self.movers:
            x, y = mover.places[0]
            someone = world.who_is_at(Obstacle(x, y, mover.radius))
            if someone:
                where = f"({x:.2f}, {y:.2f}) is taken by {someone}"
                raise NavigationError(f"{self.name}: {mover.name}: first place: {where}")
            world.add_mover(
                mover.name, mover.places, radius=mover.radius, speed=mover.speed, loop=mover.loop
            )
        for door in self.doors:
            world.add_door(door.name, door.ends, travel=door.seconds, is_open=door.is_open)
        world.docks = self.docks
        return world


def load_world(path: Path) -> WorldSpec:
    """Read a world file; paths in it are relative to its folder.

    Raises:
        InputFileError: a file has problems; each is listed with its line and field.
    """
    document = Document(path)
    top = document.top
    grid = load_map(path.parent / top.text("map", REQUIRED) if "map" in top else OFFICE_MAP)
    config = _config(top, "robot", path.parent, OFFICE_ROBOT)
    names = _Names()
    robots = tuple(
        _robot(row, f"robot_{i}", config, grid, path.parent, names)
        for i, row in enumerate(_rows(top, "robots"))
    )
    movers = tuple(
        _mover(row, f"obstacle_{i}", grid, names) for i, row in enumerate(_rows(top, "moving"))
    )
    doors = tuple(_door(row, f"door_{i}", grid, names) for i, row in enumerate(_rows(top, "doors")))
    docks = tuple(
        _dock(row, f"dock_{i}", config, grid, names) for i, row in enumerate(_rows(top, "docks"))
    )
    top.allow("map", "robot", "robots", "moving", "doors", "docks")
    top.close()
    document.check()
    return WorldSpec(path.name, grid, robots, movers, doors, docks)


def place_robots(
    grid: OccupancyMap, config: SimConfig, count: int, *, first: int = 0
) -> tuple[RobotSpec, ...]:
    """Place robots robot_0, robot_1, ... at free places, starting where `config` says.

    Each is as close to that start as the others allow.

    Raises:
        NavigationError: there is not enough space.
    """
    floor = Floor(grid, config.robot.radius, config.planner)
    step = 2.0 * config.robot.radius + _APART
    poses = [config.start]
    for pose in _spiral(config.start, step, max(grid.width, grid.height) * grid.resolution):
        if len(poses) >= count:
            break
        if _is_standing_room(floor, pose):
            poses.append(pose)
    if len(poses) < count:
        raise NavigationError(f"got {count} robots; expected {len(poses)} at most on this floor")
    return tuple(
        RobotSpec(f"robot_{first + i}", pose, replace(config, start=pose))
        for i, pose in enumerate(poses[:count])
    )


def _is_standing_room(floor: Floor, pose: Pose2D) -> bool:
    try:
        floor.check_place(pose.x, pose.y)
    except NavigationError:
        return False
    return True


def _spiral(middle: Pose2D, step: float, reach: float) -> Iterator[Pose2D]:
    """Yield the places of a square grid around `middle`, ring by ring from the inside."""
    for ring in range(1, math.ceil(reach / step) + 1):
        for i in range(-ring, ring + 1):
            for j in range(-ring, ring + 1):
                if max(abs(i), abs(j)) == ring:
                    yield Pose2D(middle.x + i * step, middle.y + j * step, middle.yaw)


class _Names:
    """Finds invalid names, and names that are used twice."""

    def __init__(self) -> None:
        self._lines: dict[tuple[str, str], int] = {}

    def read(self, section: Section, kind: str, default: str) -> str:
        """Return the name in a section."""
        name = section.text("name", default)
        try:
            check_base_name(name, f"{kind} name")
        except InvalidNameError as error:
            section.problem("name", f"a {kind} name of one word", f"{error.reason}.")
        line = section.line("name")
        if (kind, name) in self._lines:
            other = self._lines[kind, name]
            section.problem("name", f"another name than the {kind} in line {other}")
        self._lines[kind, name] = line
        return name


def _rows(top: Section, key: str) -> Sequence[Section]:
    return top.rows(key) if key in top else ()


def _config(section: Section, key: str, folder: Path, default: Path | SimConfig) -> SimConfig:
    if key in section:
        return load_config(folder / section.text(key, REQUIRED))
    return default if isinstance(default, SimConfig) else load_config(default)


def _robot(
    row: Section,
    default: str,
    config: SimConfig,
    grid: OccupancyMap,
    folder: Path,
    names: _Names,
) -> RobotSpec:
    name = names.read(row, "robot", default)
    config = _config(row, "config", folder, config)
    if "charge" in row:
        charge = row.number("charge", REQUIRED, _CHARGE)
        config = replace(config, battery=replace(config.battery, charge=charge))
    pose = _standing(row, config, grid)
    row.allow("config", "charge")
    row.close()
    return RobotSpec(name, pose, replace(config, start=pose))


def _standing(row: Section, config: SimConfig, grid: OccupancyMap) -> Pose2D:
    """Read a pose at which the robot can stand; the section stays open."""
    x = row.number("x", REQUIRED, unit="m")
    y = row.number("y", REQUIRED, unit="m")
    yaw = row.number("yaw", 0.0, unit="rad")
    if "x" in row and "y" in row:
        try:
            Floor(grid, config.robot.radius, config.planner).check_place(x, y)
        except NavigationError as error:
            reason = str(error).removeprefix("goal ")
            row.problem("x", "a place where the robot can stand", f"{reason}.")
    return Pose2D(x, y, yaw)


def _mover(row: Section, default: str, grid: OccupancyMap, names: _Names) -> MoverSpec:
    name = names.read(row, "moving obstacle", default)
    radius = row.number("radius", 0.3, _RADIUS, "m")
    speed = row.number("speed", 0.8, _SPEED, "m/s")
    loop = row.flag("loop", default=False)
    places = []
    for place in row.rows("places"):
        x = place.number("x", REQUIRED, unit="m")
        y = place.number("y", REQUIRED, unit="m")
        place.close()
        if grid.cell(x, y) is None:
            place.problem("x", "a place on the map", f"({x:.2f}, {y:.2f}) is outside.")
        places.append((x, y))
    row.close()
    return MoverSpec(name, tuple(places), radius, speed, loop)


def _door(row: Section, default: str, grid: OccupancyMap, names: _Names) -> DoorSpec:
    name = names.read(row, "door", default)
    keys = ("x0", "y0", "x1", "y1")
    x0, y0, x1, y1 = (row.number(key, REQUIRED, unit="m") for key in keys)
    seconds = row.number("seconds", 3.0, _SECONDS, "s")
    is_open = row.flag("open", default=False)
    row.close()
    if all(key in row for key in keys):
        if math.hypot(x1 - x0, y1 - y0) < _SHORTEST_DOOR:
            row.problem("x1", f"an end at least {_SHORTEST_DOOR} m from (x0, y0)")
        for key, x, y in (("x0", x0, y0), ("x1", x1, y1)):
            if grid.cell(x, y) is None:
                row.problem(key, "a place on the map", f"({x:.2f}, {y:.2f}) is outside.")
    return DoorSpec(name, (x0, y0, x1, y1), seconds, is_open)


def _dock(row: Section, default: str, config: SimConfig, grid: OccupancyMap, names: _Names) -> Dock:
    name = names.read(row, "dock", default)
    pose = _standing(row, config, grid)
    row.close()
    return Dock(name, pose)
