"""What is solid on a floor, and where a robot can stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from missions.exceptions import NavigationError
from missions.move_base.occupancy import UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from missions.move_base.config import PlannerConfig
    from missions.move_base.occupancy import OccupancyMap

_SOLID_FROM = 50  # `scale` and `raw` maps: this occupancy and more counts as solid


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


class Floor:
    """A map with obstacles, for a robot of a certain size.

    Attributes:
        map: The map beneath.
        radius: Body and margin [m]: nothing solid may be nearer to the robot's centre than this.
        obstacles: What was added to the map.
        solid: bool (rows, columns): walls, obstacles and what is unknown.
    """

    def __init__(
        self,
        grid: OccupancyMap,
        body_radius: float,
        config: PlannerConfig,
        obstacles: Iterable[Obstacle] = (),
    ) -> None:
        self.map = grid
        self.radius = body_radius + config.margin
        self.obstacles = tuple(obstacles)
        self.solid: NDArray[np.bool_] = grid.cells >= _SOLID_FROM
        if not config.unknown_is_free:
            self.solid |= grid.cells == UNKNOWN
        for obstacle in self.obstacles:
            _stamp(self.solid, grid, obstacle)

    def check_place(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell (row, column) of a place where the robot is to stand.

        Raises:
            NavigationError: it cannot stand there; the text says why.
        """
        cell = self.map.cell(x, y)
        where = f"goal ({x:.2f}, {y:.2f})"
        if cell is None:
            raise NavigationError(f"{where} is outside the map")
        if self.solid[cell]:
            raise NavigationError(f"{where} is in a wall or another solid thing")
        if self.clearance(*cell) < self.radius:
            raise NavigationError(
                f"{where} is too near to a wall: the robot needs {self.radius:.2f} m around it"
            )
        return cell

    def clearance(self, row: int, column: int) -> float:
        """Return the room [m] around a cell's centre, looked for no farther than the radius."""
        resolution = self.map.resolution
        reach = math.ceil(self.radius / resolution) + 1
        r0, c0 = max(0, row - reach), max(0, column - reach)
        rows, columns = np.nonzero(self.solid[r0 : row + reach + 1, c0 : column + reach + 1])
        height, width = self.solid.shape
        cells = float(min(row + 1, height - row, column + 1, width - column, reach + 1))
        if rows.size:
            cells = min(cells, float(np.hypot(rows + r0 - row, columns + c0 - column).min()))
        return (cells - 0.5) * resolution


def _stamp(solid: NDArray[np.bool_], grid: OccupancyMap, obstacle: Obstacle) -> None:
    """Make the cells under an obstacle solid."""
    centre = grid.cell(obstacle.x, obstacle.y)
    if centre is None:
        return
    reach = math.ceil(obstacle.radius / grid.resolution) + 1
    row, column = centre
    r0, r1 = max(0, row - reach), min(grid.height, row + reach + 1)
    c0, c1 = max(0, column - reach), min(grid.width, column + reach + 1)
    rows, columns = np.mgrid[r0:r1, c0:c1]
    near = np.hypot(rows - row, columns - column) * grid.resolution <= obstacle.radius
    solid[r0:r1, c0:c1] |= near
