"""Casts rays over the map and against round and straight things."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.ndimage import distance_transform_edt

from smachpy.places.floor import SOLID_FROM, Bar, Obstacle

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from smachpy.places.floor import Thing
    from smachpy.places.occupancy import OccupancyMap

    Floats = NDArray[np.float64]

_SHORTEST: Final = 0.5  # [cells] the shortest step of a ray, so that it always advances
_TINY: Final = 1e-12


class Raycaster:
    """Casts rays over one map; unknown cells hide nothing.

    Threads: any number of threads may cast at the same time.
    """

    def __init__(self, grid: OccupancyMap) -> None:
        self._grid = grid
        solid = np.pad(grid.cells >= SOLID_FROM, 1, constant_values=True)  # the edge ends a ray
        # Sphere tracing: from anywhere in a cell, a ray may advance by this many cells without
        # meeting a solid one. The diagonal of a cell is subtracted, as distances are between
        # centres.
        distances = distance_transform_edt(~solid) - math.sqrt(2.0)
        self._step = np.where(solid, -1.0, np.maximum(distances, _SHORTEST)).astype(np.float32)

    def cast(self, x: float, y: float, bearings: Floats, reach: float) -> Floats:
        """Return the distance to the first wall for each bearing [m; rad, map frame].

        Infinite if there is none within `reach` [m]. The map's edge counts as a wall.
        """
        grid = self._grid
        origin = grid.origin
        c, s = math.cos(origin.yaw), math.sin(origin.yaw)
        dx, dy = x - origin.x, y - origin.y
        # In cells. The table is padded by one cell, hence the + 1 below.
        column, row = (c * dx + s * dy) / grid.resolution, (c * dy - s * dx) / grid.resolution
        far = reach / grid.resolution
        result = np.full(bearings.shape, np.inf)
        if not (0.0 <= column < grid.width and 0.0 <= row < grid.height):
            return result
        cos, sin = np.cos(bearings - origin.yaw), np.sin(bearings - origin.yaw)
        left, gone = np.arange(bearings.size), np.zeros(bearings.size)
        while left.size:
            columns = (column + 1.0 + gone * cos).astype(np.intp)
            rows = (row + 1.0 + gone * sin).astype(np.intp)
            step = self._step[rows, columns]
            hit = step < 0.0
            result[left[hit]] = gone[hit] * grid.resolution
            gone = gone + step
            on = ~hit & (gone <= far)
            left, gone, cos, sin = left[on], gone[on], cos[on], sin[on]
        return result

    def sees(self, x: float, y: float, points: Floats) -> NDArray[np.bool_]:
        """Return which points (n, 2) are not hidden by a wall."""
        dx, dy = points[:, 0] - x, points[:, 1] - y
        distances = np.hypot(dx, dy)
        if not distances.size:
            return np.zeros(0, dtype=np.bool_)
        ranges = self.cast(x, y, np.arctan2(dy, dx), float(distances.max()))
        visible: NDArray[np.bool_] = ranges >= distances - self._grid.resolution
        return visible


def cast_at(things: Iterable[Thing], x: float, y: float, bearings: Floats) -> Floats:
    """Return the distance to the first of `things` for each bearing [m; rad], else infinity.

    It is 0 for a ray that starts inside a thing.
    """
    ux, uy = np.cos(bearings), np.sin(bearings)
    nearest = np.full(bearings.shape, np.inf)
    for thing in things:
        for disc in _discs(thing):
            met = _meet_disc(disc.x - x, disc.y - y, disc.radius, ux, uy)
            nearest = np.minimum(nearest, met)
        if isinstance(thing, Bar):
            for end in _sides(thing):
                nearest = np.minimum(nearest, _meet_line(end, x, y, ux, uy))
            if thing.gap(x, y) <= 0.0:
                nearest[:] = 0.0
    return nearest


def _discs(thing: Thing) -> tuple[Obstacle, ...]:
    if isinstance(thing, Bar):
        return (
            Obstacle(thing.x0, thing.y0, thing.radius),
            Obstacle(thing.x1, thing.y1, thing.radius),
        )
    return (thing,)


def _sides(bar: Bar) -> tuple[tuple[float, float, float, float], ...]:
    """Return the two long sides of a bar as lines (x0, y0, x1, y1)."""
    dx, dy = bar.x1 - bar.x0, bar.y1 - bar.y0
    length = math.hypot(dx, dy)
    if length < _TINY:
        return ()
    nx, ny = -dy / length * bar.radius, dx / length * bar.radius
    return (
        (bar.x0 + nx, bar.y0 + ny, bar.x1 + nx, bar.y1 + ny),
        (bar.x0 - nx, bar.y0 - ny, bar.x1 - nx, bar.y1 - ny),
    )


def _meet_disc(dx: float, dy: float, radius: float, ux: Floats, uy: Floats) -> Floats:
    """Return the distances at which rays from the origin meet a disc around (dx, dy)."""
    square = dx * dx + dy * dy - radius * radius
    if square <= 0.0:
        return np.zeros(ux.shape)
    along = ux * dx + uy * dy
    inside = along * along - square
    meets = (inside >= 0.0) & (along > 0.0)
    return np.where(meets, along - np.sqrt(np.maximum(inside, 0.0)), np.inf)


def _meet_line(
    line: tuple[float, float, float, float], x: float, y: float, ux: Floats, uy: Floats
) -> Floats:
    """Return the distances at which rays from (x, y) meet a line between two points."""
    ax, ay = line[0] - x, line[1] - y
    bx, by = line[2] - line[0], line[3] - line[1]
    cross = ux * by - uy * bx
    safe = np.where(np.abs(cross) < _TINY, np.inf, cross)
    distance = (ax * by - ay * bx) / safe
    share = (ax * uy - ay * ux) / safe
    meets = (distance > 0.0) & (share >= 0.0) & (share <= 1.0) & np.isfinite(safe)
    return np.where(meets, distance, np.inf)
