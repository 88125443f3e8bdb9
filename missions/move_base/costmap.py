"""Where the robot's centre may be, and what being there costs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.ndimage import distance_transform_edt

from missions.exceptions import NavigationError
from missions.move_base.occupancy import OCCUPIED, UNKNOWN

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from missions.move_base.config import PlannerConfig
    from missions.move_base.occupancy import OccupancyMap

_DECAY = 3.0  # the extra cost falls to exp(-3), a twentieth, at `wall_distance`
_HALF_OCCUPIED = 50  # `scale` and `raw` maps: this and more counts as solid


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


class Costmap:
    """A map inflated by the robot's body.

    Immutable: obstacles that appear make a new one.

    Attributes:
        map: The map beneath.
        radius: Body and margin [m]: nothing solid may be nearer to the centre than this.
        blocked: bool (rows, columns): the centre must not be here.
        cost: float32 (rows, columns): what a metre costs here, 1 in the open.
        obstacles: What was added to the map.
    """

    def __init__(
        self,
        grid: OccupancyMap,
        body_radius: float,
        config: PlannerConfig,
        obstacles: Iterable[Obstacle] = (),
    ) -> None:
        self.map = grid
        self.obstacles = tuple(obstacles)
        self.radius = body_radius + config.margin
        solid = grid.cells >= _HALF_OCCUPIED
        if not config.unknown_is_free:
            solid |= grid.cells == UNKNOWN
        for obstacle in self.obstacles:
            _stamp(solid, grid, obstacle)
        clearance = _clearance(solid, grid.resolution)
        self.blocked: NDArray[np.bool_] = clearance < self.radius
        self.cost = _cost(clearance - self.radius, config)
        # Looked up one at a time by the control loop: bytes answer faster than an array.
        self._free = (~self.blocked).tobytes()
        self._touching = (clearance < body_radius - grid.resolution).tobytes()
        self._solid = solid
        self._height, self._width = grid.height, grid.width
        origin, scale = grid.origin, 1.0 / grid.resolution
        self._ux, self._uy = math.cos(origin.yaw) * scale, math.sin(origin.yaw) * scale

    def is_free(self, x: float, y: float) -> bool:
        """Tell whether the robot's centre may be at this point of the map frame."""
        index = self._index(x, y)
        return index >= 0 and self._free[index] == 1

    def touches(self, x: float, y: float) -> bool:
        """Tell whether the body (without margin) would overlap something solid here.

        Half a cell's overlap is forgiven: the map knows no better.
        """
        index = self._index(x, y)
        return index < 0 or self._touching[index] == 1

    def check_place(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell (row, column) of a place where the robot is to stand.

        Raises:
            NavigationError: it cannot stand there; the text says why.
        """
        cell = self.map.cell(x, y)
        where = f"goal ({x:.2f}, {y:.2f})"
        if cell is None:
            raise NavigationError(f"{where} is outside the map")
        if self._solid[cell]:
            raise NavigationError(f"{where} is in a wall or another solid thing")
        if self.blocked[cell]:
            raise NavigationError(
                f"{where} is too near to a wall: the robot needs {self.radius:.2f} m around it"
            )
        return cell

    def _index(self, x: float, y: float) -> int:
        """Return the number of the cell at a point, counted row by row; -1 outside the map."""
        origin = self.map.origin
        dx, dy = x - origin.x, y - origin.y
        column = math.floor(self._ux * dx + self._uy * dy)
        row = math.floor(self._ux * dy - self._uy * dx)
        if 0 <= row < self._height and 0 <= column < self._width:
            return row * self._width + column
        return -1

    def line_cost(self, start: tuple[float, float], end: tuple[float, float]) -> float:
        """Return the cost of driving straight between two cells (row, column), in cells.

        Infinite when the way is blocked.
        """
        length = math.hypot(end[0] - start[0], end[1] - start[1])
        count = int(2.0 * length) + 2
        rows = np.rint(np.linspace(start[0], end[0], count)).astype(np.intp)
        columns = np.rint(np.linspace(start[1], end[1], count)).astype(np.intp)
        if self.blocked[rows, columns].any():
            return math.inf
        return length * float(self.cost[rows, columns].mean())

    def polyline_is_free(self, points: Sequence[tuple[float, float]]) -> bool:
        """Tell whether every point (x, y) of a way may be driven over."""
        return all(self.is_free(x, y) for x, y in points)


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


def _clearance(solid: NDArray[np.bool_], resolution: float) -> NDArray[np.float64]:
    """Return the distance [m] from each cell's centre to the next solid cell or the map's edge."""
    walled = np.pad(solid, 1, constant_values=True)
    cells = distance_transform_edt(~walled)[1:-1, 1:-1]
    clearance: NDArray[np.float64] = (cells - 0.5) * resolution
    return clearance


def _cost(room: NDArray[np.float64], config: PlannerConfig) -> NDArray[np.float32]:
    """Return what a metre costs, from the room [m] left beside the body."""
    if config.wall_distance == 0 or config.wall_weight == 0:
        return np.ones(room.shape, dtype=np.float32)
    share = np.clip(room, 0.0, config.wall_distance) / config.wall_distance
    near = np.where(share < 1.0, np.exp(-_DECAY * share), 0.0)
    return (1.0 + config.wall_weight * near).astype(np.float32)


assert OCCUPIED > _HALF_OCCUPIED
