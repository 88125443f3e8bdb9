"""Reads world files: a map, robots, moving obstacles, doors and docks, in one YAML file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, TypeVar

from actionlib_core.exceptions import InvalidNameError
from actionlib_core.inputs.checked_file import REQUIRED, CheckedFile, Limits
from actionlib_core.names import check_base_name
from smachpy.places.exceptions import InputFileError, NavigationError
from smachpy.places.floor import Floor, Obstacle
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.occupancy import load_map
from smachpy.places.pose import Pose2D
from smachpy.places.robot_file import SimConfig, load_config, read_file
from smachpy.sim.world import Dock, Robot, World

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from actionlib_core.inputs.checked_file import Section
    from smachpy.places.occupancy import OccupancyMap
    from smachpy.places.robot_file import PlannerConfig

T = TypeVar("T")

_SPEED: Final = Limits(above=0, high=10)
_RADIUS: Final = Limits(above=0, high=5)
_SECONDS: Final = Limits(low=0, high=600)
_CHARGE: Final = Limits(low=0, high=1)
MAX_THINGS: Final = 500
"""Robots, moving obstacles, doors and docks of a world, each."""

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
    reader = _WorldReader(CheckedFile(path, InputFileError))
    robots = reader.read_each("robots", reader.robot, "robot_{}")
    movers = reader.read_each("moving", reader.mover, "obstacle_{}")
    doors = reader.read_each("doors", reader.door, "door_{}")
    docks = reader.read_each("docks", reader.dock, "dock_{}")
    reader.file.top.close()
    reader.file.check()
    assert reader.grid is not None  # otherwise there is a problem
    return WorldSpec(path.name, reader.grid, robots, movers, doors, docks)


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


class _WorldReader:
    """Reads the parts of a world; without a map or parameters of a robot, as far as possible."""

    def __init__(self, file: CheckedFile) -> None:
        self.file = file
        self.grid = read_file(file.top, "map", load_map, OFFICE_MAP)
        self._config = read_file(file.top, "robot", load_config, OFFICE_ROBOT)
        self._names: dict[tuple[str, str], int] = {}  # kind and name -> line
        self._floors: dict[tuple[float, PlannerConfig], Floor] = {}
        self._stands: list[tuple[float, float, float, str]] = []  # x, y, radius, name of robots

    def read_each(
        self, key: str, read: Callable[[Section, str], T], default_name: str
    ) -> tuple[T, ...]:
        top = self.file.top
        top.allow(key)
        rows = top.rows(key) if key in top else ()
        if len(rows) > MAX_THINGS:
            top.report(key, f"got {len(rows)}; expected at most {MAX_THINGS}.")
            return ()
        return tuple(read(row, default_name.format(i)) for i, row in enumerate(rows))

    def robot(self, row: Section, default: str) -> RobotSpec:
        name = self._name(row, "robot", default)
        row.allow("config", "charge")  # that are not always read
        config = read_file(row, "config", load_config) if "config" in row else self._config
        pose = self._standing(row, config)
        config = replace(config or SimConfig(), start=pose)
        if row.is_good("x", "y"):
            radius = config.robot.radius
            self._check_free(row, pose.x, pose.y, radius)
            self._stands.append((pose.x, pose.y, radius, name))
        if "charge" in row:
            charge = row.number("charge", REQUIRED, _CHARGE)
            config = replace(config, battery=replace(config.battery, charge=charge))
        row.close()
        return RobotSpec(name, pose, config)

    def mover(self, row: Section, default: str) -> MoverSpec:
        name = self._name(row, "moving obstacle", default)
        radius = row.number("radius", 0.3, _RADIUS, "m")
        speed = row.number("speed", 0.8, _SPEED, "m/s")
        loop = row.flag("loop", default=False)
        places = []
        for place in row.rows("places"):
            places.append(self._place_on_map(place, "x", "y"))
            if len(places) == 1 and place.is_good("x", "y"):
                self._check_free(place, *places[0], radius)
            place.close()
        row.close()
        return MoverSpec(name, tuple(places), radius, speed, loop)

    def door(self, row: Section, default: str) -> DoorSpec:
        name = self._name(row, "door", default)
        ends = (*self._place_on_map(row, "x0", "y0"), *self._place_on_map(row, "x1", "y1"))
        seconds = row.number("seconds", 3.0, _SECONDS, "s")
        is_open = row.flag("open", default=False)
        row.close()
        if row.is_good("x0", "y0", "x1", "y1") and math.dist(ends[:2], ends[2:]) < _SHORTEST_DOOR:
            row.problem("x1", f"an end at least {_SHORTEST_DOOR} m from (x0, y0)")
        return DoorSpec(name, ends, seconds, is_open)

    def dock(self, row: Section, default: str) -> Dock:
        name = self._name(row, "dock", default)
        pose = self._standing(row, self._config)
        row.close()
        return Dock(name, pose)

    def _name(self, row: Section, kind: str, default: str) -> str:
        """Read a name, which nothing else of this kind has."""
        name = row.text("name", default)
        try:
            check_base_name(name, f"{kind} name")
        except InvalidNameError as error:
            row.problem("name", f"a {kind} name of one word", f"{error.reason}.")
        if (kind, name) in self._names:
            other = self._names[kind, name]
            row.problem("name", f"another name than the {kind} in line {other}")
        self._names[kind, name] = row.line("name")
        return name

    def _standing(self, row: Section, config: SimConfig | None) -> Pose2D:
        """Read a pose at which the robot can stand; the section stays open."""
        x = row.number("x", REQUIRED, unit="m")
        y = row.number("y", REQUIRED, unit="m")
        yaw = row.number("yaw", 0.0, unit="rad")
        if row.is_good("x", "y") and self.grid is not None and config is not None:
            size = config.robot.radius, config.planner
            if size not in self._floors:  # making one takes long on a large map
                self._floors[size] = Floor(self.grid, *size)
            try:
                self._floors[size].check_place(x, y)
            except NavigationError as error:
                reason = str(error).removeprefix("goal ")
                row.problem("x", "a place where the robot can stand", f"{reason}.")
        return Pose2D(x, y, yaw)

    def _check_free(self, row: Section, x: float, y: float, radius: float) -> None:
        """Report the start of a thing where a robot above it in the file stands."""
        for other_x, other_y, other_radius, name in self._stands:
            if math.hypot(other_x - x, other_y - y) < other_radius + radius:
                row.problem("x", "a free place", f"({x:.2f}, {y:.2f}) is taken by {name}.")
                return

    def _place_on_map(self, row: Section, x_key: str, y_key: str) -> tuple[float, float]:
        x, y = (row.number(key, REQUIRED, unit="m") for key in (x_key, y_key))
        if row.is_good(x_key, y_key) and self.grid is not None and self.grid.cell(x, y) is None:
            row.problem(x_key, "a place on the map", f"({x:.2f}, {y:.2f}) is outside.")
        return x, y
