"""The cheapest way over the floor: Dijkstra on the cells, then a smooth line."""

from __future__ import annotations

import itertools
import math
import threading
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from missions.exceptions import NavigationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from missions.move_base.costmap import Costmap

Point = tuple[float, float]  # (x, y) [m], map frame
Cell = tuple[int, int]  # (row, column)

_NEIGHBOURS: Final = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))
_KEPT_FIELDS: Final = 64  # trees kept, one per goal cell: 0.7 MB each for the office
_KEPT_WAYS: Final = 256  # finished ways kept, one per start cell and goal
_SPACING: Final = 0.05  # [m] between the points of a finished way
_ROUNDS: Final = 3  # of corner cutting
_SLACK: Final = 1.02  # a straight line may cost this much more than the bends it replaces
_RESCUE: Final = 0.5  # [m] a robot that stands too near to something may creep out of it


class Planner:
    """Finds ways on one costmap.

    The search runs backwards from the goal over the whole floor, so that its tree answers every
    start; trees and ways of the last goals are kept, so a patrol's second round is nearly free.

    Threads: every method may be called from any thread; one plans at a time.
    """

    def __init__(self, costmap: Costmap) -> None:
        self.costmap = costmap
        self._lock = threading.Lock()
        self._graph: csr_array | None = None
        self._trees: OrderedDict[Cell, NDArray[np.int32]] = OrderedDict()
        self._ways: OrderedDict[tuple[Cell, Point], list[Point]] = OrderedDict()

    def plan(self, start: Point, goal: Point) -> list[Point]:
        """Return the way from `start` to `goal`: points about 5 cm apart, both ends included.

        Raises:
            NavigationError: the goal is outside the map, in something solid, too near to it, or
                cannot be reached.
        """
        target = self.costmap.check_place(*goal)
        source = self._start_cell(start)
        with self._lock:
            way = self._ways.get((source, goal))
            if way is None:
                way = self._make_way(source, target, start, goal)
                self._ways[source, goal] = way
                if len(self._ways) > _KEPT_WAYS:
                    self._ways.popitem(last=False)
        return [start, *way[1:]]

    def _make_way(self, source: Cell, target: Cell, start: Point, goal: Point) -> list[Point]:
        cells = self._walk(source, target)
        corners = [self.costmap.map.centre(*cell) for cell in self._straighten(cells)]
        if self.costmap.is_free(*start):
            corners[0] = start
        else:
            corners.insert(0, start)
        corners[-1] = goal
        return self._smooth(corners)

    def _start_cell(self, start: Point) -> Cell:
        """Return the cell to search from: the robot's own, or the nearest one that is free."""
        cell = self.costmap.map.cell(*start)
        if cell is None:
            raise NavigationError(
                f"the robot at ({start[0]:.2f}, {start[1]:.2f}) is outside the map"
            )
        if not self.costmap.blocked[cell]:
            return cell
        reach = math.ceil(_RESCUE / self.costmap.map.resolution)
        r0, c0 = max(0, cell[0] - reach), max(0, cell[1] - reach)
        window = self.costmap.blocked[r0 : cell[0] + reach + 1, c0 : cell[1] + reach + 1]
        rows, columns = np.nonzero(~window)
        if not rows.size:
            raise NavigationError(
                f"no way: the robot at ({start[0]:.2f}, {start[1]:.2f}) is shut in on all sides"
            )
        nearest = int(np.argmin(np.hypot(rows + r0 - cell[0], columns + c0 - cell[1])))
        return int(rows[nearest]) + r0, int(columns[nearest]) + c0

    def _walk(self, source: Cell, target: Cell) -> list[Cell]:
        """Follow the goal's tree from the start."""
        width = self.costmap.map.width
        tree = self._tree(target)
        node, end = source[0] * width + source[1], target[0] * width + target[1]
        cells = [source]
        while node != end:
            node = int(tree[node])
            if node < 0:
                x, y = self.costmap.map.centre(*target)
                raise NavigationError(f"no way to ({x:.2f}, {y:.2f}): every path is blocked")
            cells.append(divmod(node, width))
        return cells

    def _tree(self, target: Cell) -> NDArray[np.int32]:
        """Return for each cell the next one on the way to `target`, negative where none is."""
        tree = self._trees.get(target)
        if tree is None:
            if self._graph is None:
                self._graph = _graph(self.costmap)
            root = target[0] * self.costmap.map.width + target[1]
            _, tree = dijkstra(self._graph, indices=root, return_predecessors=True)
            self._trees[target] = tree
            if len(self._trees) > _KEPT_FIELDS:
                self._trees.popitem(last=False)
        else:
            self._trees.move_to_end(target)
        return tree

    def _straighten(self, cells: list[Cell]) -> list[Cell]:
        """Replace bends by straight lines wherever those cost no more."""
        cost = self.costmap.cost
        rows, columns = np.array(cells, dtype=np.intp).T
        steps = np.hypot(np.diff(rows), np.diff(columns))
        along = cost[rows, columns]
        spent = np.concatenate(([0.0], np.cumsum(steps * (along[1:] + along[:-1]) / 2.0)))
        kept, here, last = [cells[0]], 0, len(cells) - 1
        while here < last:
            jump = 1
            while jump * 2 <= last - here and self._may_cut(cells, spent, here, here + jump * 2):
                jump *= 2
            low, high = here + jump, min(here + jump * 2, last)
            while low < high:  # the farthest cell that can be reached straight
                middle = (low + high + 1) // 2
                if self._may_cut(cells, spent, here, middle):
                    low = middle
                else:
                    high = middle - 1
            here = low
            kept.append(cells[here])
        return kept if len(kept) > 1 else [cells[0], cells[-1]]

    def _may_cut(
        self, cells: list[Cell], spent: NDArray[np.float64], first: int, last: int
    ) -> bool:
        allowed = float(spent[last] - spent[first]) * _SLACK
        return self.costmap.line_cost(cells[first], cells[last]) <= allowed

    def _smooth(self, corners: list[Point]) -> list[Point]:
        """Cut the corners (Chaikin) as far as that stays free, then space the points evenly."""
        points = corners
        for _ in range(_ROUNDS):
            rounder = _cut_corners(points)
            if not self.costmap.polyline_is_free(_space(rounder)[1:]):
                break
            points = rounder
        return _space(points)


def _graph(costmap: Costmap) -> csr_array:
    """Return the 8-connected graph of the free cells; an edge weighs its length times its cost."""
    height, width = costmap.blocked.shape
    cost = np.pad(np.where(costmap.blocked, np.inf, costmap.cost), 1, constant_values=np.inf)
    inner = cost[1:-1, 1:-1]
    index = np.arange(height * width, dtype=np.int32).reshape(height, width)
    weights = np.empty((height, width, len(_NEIGHBOURS)))
    targets = np.empty((height, width, len(_NEIGHBOURS)), dtype=np.int32)
    for k, (dr, dc) in enumerate(_NEIGHBOURS):
        other = cost[1 + dr : 1 + dr + height, 1 + dc : 1 + dc + width]
        weights[:, :, k] = (inner + other) * (0.5 * math.hypot(dr, dc))
        targets[:, :, k] = index + (dr * width + dc)
    open_edges = np.isfinite(weights)
    ends = np.concatenate(([0], np.cumsum(open_edges.sum(axis=2).ravel()))).astype(np.int32)
    shape = (height * width, height * width)
    return csr_array((weights[open_edges], targets[open_edges], ends), shape=shape)


def _cut_corners(points: list[Point]) -> list[Point]:
    """Replace each corner by two points a quarter of the way along its edges.

    Source: G. Chaikin, "An algorithm for high-speed curve generation", 1974.
    """
    if len(points) <= 2:  # noqa: PLR2004  a straight line has no corner
        return points
    result = [points[0]]
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        result += [(0.75 * x0 + 0.25 * x1, 0.75 * y0 + 0.25 * y1)]
        result += [(0.25 * x0 + 0.75 * x1, 0.25 * y0 + 0.75 * y1)]
    return [result[0], *result[2:-1], points[-1]]


def _space(points: list[Point]) -> list[Point]:
    """Return points at most `_SPACING` apart along the same line."""
    result = [points[0]]
    for (x0, y0), (x1, y1) in itertools.pairwise(points):
        count = max(1, math.ceil(math.hypot(x1 - x0, y1 - y0) / _SPACING))
        result += [
            (x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count) for i in range(1, count + 1)
        ]
    return result
