"""A map of what a robot's scanner has seen so far, and the frontiers to the unseen area."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy import ndimage

from smachpy import register_type
from smachpy.places.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from smachpy.states import Pose2D
from smachpy_missions.explore.scans import rays_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from actionlib_core.interfaces.sensor_msgs.msg import LaserScan

    Cells = NDArray[np.bool_]

RESOLUTION: Final = 0.1  # [m]
# Cells by which the grid grows at least: growing copies it, so it must not happen with each scan.
_CHUNK: Final = 64
# A hit counts as much as this many misses: rays that graze a wall pass through cells of the wall
# more often than they end in them.
_HIT_WEIGHT: Final = 3
_NEAR: Final = 10  # cells: the largest distance between a frontier and the place to look from
# [m] added to each way. Without it the smallest gap next to the robot would always come first.
_DETOUR: Final = 1.0
_LOOKED_AT: Final = 8  # cells around a frontier's nearest point that are not offered again
_SPARE: Final = 0.1  # [m] additional space where the robot stops and turns
_EIGHT: Final = np.ones((3, 3), dtype=np.bool_)  # neighbours, corners included


@register_type
@dataclass(frozen=True, slots=True)
class Frontier:
    """A place from which the robot can see a part of the unseen area.

    Attributes:
        pose: Where to stand, facing the border.
        border: The nearest point of the border to the unseen area, x and y [m].
        size: The border's length [m].
    """

    pose: Pose2D
    border: tuple[float, float]
    size: float


class SeenMap:
    """A grid of what scans have shown; it grows as needed.

    Args:
        robot_radius: Free space that the robot's centre needs on its way [m].
        smallest: Shorter borders are no frontiers but, for example, gaps between rays [m].

    Threads: every method may be called from any thread.
    """

    def __init__(self, robot_radius: float = 0.3, smallest: float = 1.0) -> None:
        self._radius = robot_radius
        self._smallest = smallest
        self._lock = threading.Lock()
        self._hits = np.zeros((0, 0), dtype=np.int32)
        self._misses = np.zeros((0, 0), dtype=np.int32)
        self._left = np.zeros((0, 0), dtype=np.bool_)  # borders that have been looked at
        self._refused = np.zeros((0, 0), dtype=np.bool_)  # places that could not be reached
        # Cell numbers of the lower left cell, in a grid whose cell (0, 0) is at the map's origin:
        # they change when the grid grows to the left or below, the cells' positions do not.
        self._x0 = self._y0 = 0

    def add(self, scan: LaserScan, pose: Pose2D) -> None:
        """Add a scan made at `pose` (map frame)."""
        rays = rays_of(scan, pose)
        if not rays.ranges.size:
            return
        # Points every half cell along each ray, so that no cell on the way is jumped over.
        steps = np.arange(0.0, rays.ranges.max(), RESOLUTION / 2.0)
        distances, angles = np.meshgrid(steps, rays.angles)
        passed = distances < rays.ranges[:, None]
        distances, angles = distances[passed], angles[passed]
        xs, ys = pose.x + distances * np.cos(angles), pose.y + distances * np.sin(angles)
        ends_x, ends_y = rays.ends(math.inf)
        hit = rays.hits
        with self._lock:
            # First, for its effect: the grid grows here. Indices from before would be wrong after.
            self._cells(np.append(ends_x, pose.x), np.append(ends_y, pose.y))
            solid = self._cells(ends_x[hit], ends_y[hit])
            free = self._cells(np.append(xs, pose.x), np.append(ys, pose.y))
            passed_by = np.zeros(self._hits.shape, dtype=np.bool_)
            passed_by[free] = True
            passed_by[solid] = False  # the cell in which a ray ends is not free
            self._misses += passed_by
            self._hits[solid] += 1

    def area(self) -> float:
        """Return how much floor has been seen [m^2]."""
        with self._lock:
            return float(self._free().sum()) * RESOLUTION * RESOLUTION

    def occupancy(self) -> OccupancyMap:
        """Return the map of everything seen so far."""
        with self._lock:
            cells = np.full(self._hits.shape, UNKNOWN, dtype=np.int8)
            cells[self._free()] = FREE
            cells[self._solid()] = OCCUPIED
            origin = Pose2D(self._x0 * RESOLUTION, self._y0 * RESOLUTION, 0.0)
        return OccupancyMap(cells, RESOLUTION, origin)

    def best_frontier(self, here: Pose2D) -> Frontier | None:
        """Return the frontier with the most border per way from `here`; None if none is reachable.

        Frontiers passed to `leave` are not offered again.
        """
        with self._lock:
            border, lengths = self._border()
            if not border.any():
                return None
            # Dilate within the free cells only: a place on the other side of a wall is not near.
            near = ndimage.binary_dilation(
                border > 0, structure=_EIGHT, iterations=_NEAR, mask=self._free()
            )
            places = self._room(self._radius + _SPARE) & near & ~self._refused
            _, (rows, columns) = ndimage.distance_transform_edt(border == 0, return_indices=True)
            labels = np.where(places, border[rows, columns], 0)
            reached = self._reach(self._room(self._radius), labels, here)
            if not reached:
                return None
            label = max(reached, key=lambda n: lengths[n] * RESOLUTION / (reached[n][0] + _DETOUR))
            _, row, column = reached[label]
            at = int(rows[row, column]), int(columns[row, column])
            rows, columns = np.nonzero(border == label)
            yaw = math.atan2(float(rows.mean()) - row, float(columns.mean()) - column)
            pose = Pose2D(*self._centre(row, column), yaw)
            return Frontier(pose, self._centre(*at), float(lengths[label]) * RESOLUTION)

    def leave(self, frontier: Frontier, *, reached: bool) -> None:
        """Do not offer this again: the border was looked at, or the place is out of reach."""
        (x, y), reach = frontier.border, _LOOKED_AT
        if not reached:
            x, y, _ = frontier.pose
            reach = math.ceil(2.0 * self._radius / RESOLUTION)
        offsets = np.arange(-reach, reach + 1) * RESOLUTION
        dx, dy = np.meshgrid(offsets, offsets)
        disc = np.hypot(dx, dy) <= reach * RESOLUTION
        with self._lock:
            cells = self._cells(x + dx[disc], y + dy[disc])  # the grid may grow
            (self._left if reached else self._refused)[cells] = True

    # -- the grid: called with the lock --------------------------------------------------------

    def _cells(
        self, xs: NDArray[np.float64], ys: NDArray[np.float64]
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the cells of points, each cell once; grow the grid to hold them."""
        columns = np.floor(xs / RESOLUTION).astype(np.intp)
        rows = np.floor(ys / RESOLUTION).astype(np.intp)
        if not rows.size:
            return rows, columns
        self._grow(rows, columns)
        width = self._hits.shape[1]
        flat = np.unique((rows - self._y0) * width + columns - self._x0)
        return flat // width, flat % width

    def _grow(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> None:
        height, width = self._hits.shape
        if not height:
            self._y0, self._x0 = int(rows.min()), int(columns.min())
        below, left = self._y0 - int(rows.min()), self._x0 - int(columns.min())
        above = int(rows.max()) - (self._y0 + height - 1)
        right = int(columns.max()) - (self._x0 + width - 1)
        below, above, left, right = (
            n + _CHUNK if n > 0 else 0 for n in (below, above, left, right)
        )
        if below or above or left or right:
            frame = ((below, above), (left, right))
            self._hits, self._misses = np.pad(self._hits, frame), np.pad(self._misses, frame)
            self._left, self._refused = np.pad(self._left, frame), np.pad(self._refused, frame)
            self._y0, self._x0 = self._y0 - below, self._x0 - left

    def _centre(self, row: int, column: int) -> tuple[float, float]:
        return (self._x0 + column + 0.5) * RESOLUTION, (self._y0 + row + 0.5) * RESOLUTION

    def _solid(self) -> Cells:
        return (self._hits > 0) & (_HIT_WEIGHT * self._hits >= self._misses)

    def _free(self) -> Cells:
        return (self._misses > 0) & ~self._solid()

    def _room(self, radius: float) -> Cells:
        """Return the free cells that are farther than `radius` [m] from any known obstacle."""
        free, solid = self._free(), self._solid()
        if not solid.any():
            return free
        clear: Cells = ndimage.distance_transform_edt(~solid) * RESOLUTION > radius
        return free & clear

    def _border(self) -> tuple[NDArray[np.int32], NDArray[np.intp]]:
        """Return the free cells next to unseen ones, numbered by frontier, and their lengths."""
        free = self._free()
        unseen = ~free & ~self._solid()
        beside = ndimage.binary_dilation(np.pad(unseen, 1, constant_values=True))[1:-1, 1:-1]
        labels, _ = ndimage.label(free & beside & ~self._left, structure=_EIGHT)
        lengths = np.bincount(labels.ravel())
        labels[lengths[labels] * RESOLUTION < self._smallest] = 0
        return labels.astype(np.int32), lengths

    def _reach(
        self, room: Cells, labels: NDArray[np.int32], here: Pose2D
    ) -> dict[int, tuple[float, int, int]]:
        """Return for each label the nearest cell that can be reached: distance [m], row, column.

        A breadth-first wave over 8 neighbours. A diagonal step counts as one cell: the distance
        only ranks frontiers, it plans no way.
        """
        column, row = math.floor(here.x / RESOLUTION), math.floor(here.y / RESOLUTION)
        row, column = row - self._y0, column - self._x0
        # Start from every free cell around the robot: where it stands there may be too little
        # space.
        reach = math.ceil(2.0 * self._radius / RESOLUTION)
        around = np.s_[
            max(0, row - reach) : row + reach + 1, max(0, column - reach) : column + reach + 1
        ]
        start = np.zeros(room.shape, dtype=np.bool_)
        start[around] = room[around]
        width = room.shape[1] + 2
        # The margin of blocked cells keeps index arithmetic from leading over the grid's edges.
        free, wanted = np.pad(room, 1).ravel(), np.pad(labels, 1).ravel()
        steps = np.array([dr * width + dc for dr in (-1, 0, 1) for dc in (-1, 0, 1)])
        found: dict[int, tuple[float, int, int]] = {}
        wave, distance = np.flatnonzero(np.pad(start, 1)), 0.0
        while wave.size:
            for label, first in zip(*np.unique(wanted[wave], return_index=True), strict=True):
                if label and label not in found:
                    cell = int(wave[first])
                    found[int(label)] = distance, cell // width - 1, cell % width - 1
            free[wave] = False
            wave = (wave[:, None] + steps).ravel()
            wave = np.unique(wave[free[wave]])
            distance += RESOLUTION
        return found
