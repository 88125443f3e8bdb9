"""The solid parts of a floor, and where a robot can stand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from smachpy.places.exceptions import NavigationError
from smachpy.places.occupancy import UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from smachpy.places.occupancy import OccupancyMap
    from smachpy.places.robot_file import PlannerConfig

SOLID_FROM = 50  # in `scale` and `raw` maps, cells with this occupancy or more are solid


@dataclass(frozen=True, slots=True)
class Sighting:
    """The last known position of a moving thing.

    Attributes:
        x: [m], map frame.
        y: [m], map frame.
        radius: [m].
        name: Its name.
    """

    x: float
    y: float
    radius: float
    name: str


class Obstacle(NamedTuple):
    """A round thing that is not on the map.

    Attributes:
        x: [m], map frame.
        y: [m], map frame.
        radius: [m].
    """

    x: float
    y: float
    radius: float

    def gap(self, x: float, y: float) -> float:
        """Return the distance from a point to its surface [m], negative inside."""
        return math.hypot(self.x - x, self.y - y) - self.radius

    def covers(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of many points are inside."""
        return np.hypot(x - self.x, y - self.y) <= self.radius

    def middle(self) -> tuple[float, float]:
        """Return its middle."""
        return self.x, self.y

    def reach(self) -> float:
        """Return its extent from its middle [m]."""
        return self.radius


class Bar(NamedTuple):
    """A straight thing with round ends that is not on the map: the leaf of a door.

    Attributes:
        x0: One end [m], map frame.
        y0: [m].
        x1: The other end [m].
        y1: [m].
        radius: Half its thickness [m].
        name: Its name.
    """

    x0: float
    y0: float
    x1: float
    y1: float
    radius: float
    name: str

    def gap(self, x: float, y: float) -> float:
        """Return the distance from a point to its surface [m], negative inside."""
        ux, uy = self.x1 - self.x0, self.y1 - self.y0
        square = ux * ux + uy * uy
        along = ((x - self.x0) * ux + (y - self.y0) * uy) / square if square else 0.0
        along = max(0.0, min(1.0, along))
        return math.hypot(self.x0 + along * ux - x, self.y0 + along * uy - y) - self.radius

    def covers(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which of many points are inside."""
        ux, uy = self.x1 - self.x0, self.y1 - self.y0
        square = ux * ux + uy * uy or 1.0
        along = np.clip(((x - self.x0) * ux + (y - self.y0) * uy) / square, 0.0, 1.0)
        return np.hypot(self.x0 + along * ux - x, self.y0 + along * uy - y) <= self.radius

    def middle(self) -> tuple[float, float]:
        """Return its middle."""
        return (self.x0 + self.x1) / 2.0, (self.y0 + self.y1) / 2.0

    def reach(self) -> float:
        """Return its extent from its middle [m]."""
        return math.hypot(self.x1 - self.x0, self.y1 - self.y0) / 2.0 + self.radius


Thing = Obstacle | Bar


class Floor:
    """A map with obstacles, for a robot of a certain size.

    Attributes:
        map: The map.
        radius: Body and margin [m]: the robot's centre must be at least this far from solid things.
        obstacles: The things added to the map.
        solid: bool (rows, columns): walls, obstacles and unknown cells.
    """

    def __init__(
        self,
        grid: OccupancyMap,
        body_radius: float,
        config: PlannerConfig,
        obstacles: Iterable[Thing] = (),
    ) -> None:
        self.map = grid
        self.radius = body_radius + config.margin
        self.obstacles = tuple(obstacles)
        self.solid: NDArray[np.bool_] = grid.cells >= SOLID_FROM
        if not config.unknown_is_free:
            self.solid |= grid.cells == UNKNOWN
        for obstacle in self.obstacles:
            stamp(self.solid, grid, obstacle)

    def check_place(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell (row, column) of a place where the robot is to stand.

        Raises:
            NavigationError: it cannot; the text says why.
        """
        cell = self.map.cell(x, y)
        where = f"goal ({x:.2f}, {y:.2f})"
        if cell is None:
            width, height = (
                cells * self.map.resolution for cells in (self.map.width, self.map.height)
            )
            raise NavigationError(f"{where} is outside the map of {width:.4g} x {height:.4g} m")
        if self.solid[cell]:
            raise NavigationError(f"{where} is in a wall or another solid thing")
        if self.clearance(*cell) < self.radius:
            raise NavigationError(
                f"{where} is too near to a wall: the robot needs {self.radius:.2f} m around it"
            )
        return cell

    def clearance(self, row: int, column: int) -> float:
        """Return the free distance around a cell's centre [m], measured up to the radius."""
        resolution = self.map.resolution
        reach = math.ceil(self.radius / resolution) + 1
        r0, c0 = max(0, row - reach), max(0, column - reach)
        rows, columns = np.nonzero(self.solid[r0 : row + reach + 1, c0 : column + reach + 1])
        height, width = self.solid.shape
        cells = float(min(row + 1, height - row, column + 1, width - column, reach + 1))
        if rows.size:
            cells = min(cells, float(np.hypot(rows + r0 - row, columns + c0 - column).min()))
        return (cells - 0.5) * resolution


def stamp(solid: NDArray[np.bool_], grid: OccupancyMap, thing: Thing) -> None:
    """Make the cells under a thing solid."""
    reach = math.ceil(thing.reach() / grid.resolution) + 1
    row, column = grid.row_column(*thing.middle())
    r0, r1 = max(0, row - reach), min(grid.height, row + reach + 1)
    c0, c1 = max(0, column - reach), min(grid.width, column + reach + 1)
    if r0 < r1 and c0 < c1:
        rows, columns = np.mgrid[r0:r1, c0:c1]
        solid[r0:r1, c0:c1] |= thing.covers(*grid.centres(rows, columns))
