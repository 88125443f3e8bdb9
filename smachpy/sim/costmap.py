"""Where the robot's centre may be, and the cost of being there."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt

from smachpy.places.floor import Floor
from smachpy.places.occupancy import OccupancyMap
from smachpy.places.pose import Pose2D

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from smachpy.places.floor import Sighting, Thing
    from smachpy.places.robot_file import PlannerConfig

_WIDE_BERTH = 0.02  # [m] added to the margin around moving things
_SHY = 0.4  # [m] beyond that, passing a moving thing costs more
_SHY_COST = 2.0  # extra cost of a metre right next to it
_FEW = 10  # with fewer points a loop is faster than an array
_CORNER = 1.5  # a bit more than sqrt(2): the corners of a square are that much farther away
_DECAY = 3.0  # the extra cost falls to exp(-3), a twentieth, at `wall_distance`


class Costmap(Floor):
    """A floor, inflated by the robot's body.

    Immutable: new obstacles need a new one.

    Attributes:
        blocked: bool (rows, columns): the robot's centre must not be here.
        cost: float32 (rows, columns): the cost of a metre, 1 in the open.
    """

    def __init__(
        self,
        grid: OccupancyMap,
        body_radius: float,
        config: PlannerConfig,
        obstacles: Iterable[Thing] = (),
    ) -> None:
        super().__init__(grid, body_radius, config, obstacles)
        clearance = _clearance(self.solid, grid.resolution)
        self.blocked: NDArray[np.bool_] = clearance < self.radius
        self.cost = _cost(clearance - self.radius, config)
        self._touching = (clearance < body_radius - grid.resolution).tobytes()
        self.index_cells()

    def cut(self, middle: tuple[float, float], reach: float, discs: Iterable[Sighting]) -> Costmap:
        """Return the part around a point, with moving things blocked where they are now.

        Args:
            middle: (x, y) [m], on the map.
            reach: Its extent on each side [m].
            discs: The moving things; inflated by this robot's body and margin, with extra cost
                close by.
        """
        grid = self.map
        row, column = grid.row_column(*middle)
        cells = math.ceil(reach / grid.resolution)
        r0, r1 = max(0, row - cells), min(grid.height, row + cells + 1)
        c0, c1 = max(0, column - cells), min(grid.width, column + cells + 1)
        part = copy.copy(self)
        corner = Pose2D(c0 * grid.resolution, r0 * grid.resolution, 0.0)
        part.map = OccupancyMap(grid.cells[r0:r1, c0:c1], grid.resolution, grid.origin.then(corner))
        part.blocked = self.blocked[r0:r1, c0:c1].copy()
        part.cost = self.cost[r0:r1, c0:c1].copy()
        for disc in discs:
            if math.hypot(disc.x - middle[0], disc.y - middle[1]) < _CORNER * reach + 1.0:
                part.put(disc)
        part.index_cells()
        return part

    def put(self, disc: Sighting) -> None:
        """Block the cells around a moving thing; only for a part that is being made."""
        grid = self.map
        inner = disc.radius + self.radius + _WIDE_BERTH
        outer = inner + _SHY
        row, column = grid.row_column(disc.x, disc.y)
        reach = math.ceil(outer / grid.resolution) + 1
        r0, r1 = max(0, row - reach), min(grid.height, row + reach + 1)
        c0, c1 = max(0, column - reach), min(grid.width, column + reach + 1)
        if r0 >= r1 or c0 >= c1:
            return
        x, y = grid.centres(*np.mgrid[r0:r1, c0:c1])
        distance = np.hypot(x - disc.x, y - disc.y)
        self.blocked[r0:r1, c0:c1] |= distance < inner
        extra = _SHY_COST * np.clip((outer - distance) / _SHY, 0.0, 1.0)
        self.cost[r0:r1, c0:c1] += extra.astype(np.float32)

    def index_cells(self) -> None:
        """Make the tables for cell look-up."""
        # The control loop looks up single cells: bytes are faster for that than an array.
        self._free = (~self.blocked).tobytes()
        grid = self.map
        self._height, self._width = grid.height, grid.width
        origin, scale = grid.origin, 1.0 / grid.resolution
        self._ux, self._uy = math.cos(origin.yaw) * scale, math.sin(origin.yaw) * scale

    def is_free(self, x: float, y: float) -> bool:
        """Return whether the robot's centre may be at this point of the map frame."""
        index = self._index(x, y)
        return index >= 0 and self._free[index] == 1

    def touches(self, x: float, y: float) -> bool:
        """Return whether the body (without margin) would overlap something solid here.

        An overlap of half a cell is tolerated: the map is no more precise.
        """
        index = self._index(x, y)
        return index < 0 or self._touching[index] == 1

    def _index(self, x: float, y: float) -> int:
        """Return the index of the cell at a point, row by row; -1 outside the map."""
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
        share = np.arange(count) / (count - 1)
        rows = np.rint(start[0] + (end[0] - start[0]) * share).astype(np.intp)
        columns = np.rint(start[1] + (end[1] - start[1]) * share).astype(np.intp)
        if self.blocked[rows, columns].any():
            return math.inf
        return length * float(self.cost[rows, columns].mean())

    def are_free(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return for many points of the map frame whether the robot's centre may be there."""
        origin = self.map.origin
        dx, dy = x - origin.x, y - origin.y
        columns = np.floor(self._ux * dx + self._uy * dy).astype(np.intp)
        rows = np.floor(self._ux * dy - self._uy * dx).astype(np.intp)
        inside = (rows >= 0) & (rows < self._height) & (columns >= 0) & (columns < self._width)
        free = np.zeros(x.shape, dtype=np.bool_)
        free[inside] = ~self.blocked[rows[inside], columns[inside]]
        return free

    def polyline_is_free(self, points: Sequence[tuple[float, float]]) -> bool:
        """Return whether every point (x, y) of a way is free."""
        if len(points) < _FEW:
            return all(self.is_free(x, y) for x, y in points)
        places = np.array(points)
        return bool(self.are_free(places[:, 0], places[:, 1]).all())


def _clearance(solid: NDArray[np.bool_], resolution: float) -> NDArray[np.float64]:
    """Return the distance from each cell's centre to the next solid cell or the map's edge [m]."""
    walled = np.pad(solid, 1, constant_values=True)
    cells = distance_transform_edt(~walled)[1:-1, 1:-1]
    clearance: NDArray[np.float64] = (cells - 0.5) * resolution
    return clearance


def _cost(room: NDArray[np.float64], config: PlannerConfig) -> NDArray[np.float32]:
    """Return the cost of a metre, for the space left beside the body [m]."""
    if config.wall_distance == 0 or config.wall_weight == 0:
        return np.ones(room.shape, dtype=np.float32)
    share = np.clip(room, 0.0, config.wall_distance) / config.wall_distance
    near = np.where(share < 1.0, np.exp(-_DECAY * share), 0.0)
    return (1.0 + config.wall_weight * near).astype(np.float32)
