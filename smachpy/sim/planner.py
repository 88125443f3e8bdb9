"""Plans the cheapest way over the floor: Dijkstra on the cells, then a smooth line."""

from __future__ import annotations

import itertools
import math
import threading
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

import numpy as np
from scipy.ndimage import minimum_filter1d, uniform_filter1d
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from smachpy.places.exceptions import NavigationError

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from smachpy.places.floor import Sighting
    from smachpy.sim.costmap import Costmap

Point = tuple[float, float]  # (x, y) [m], map frame
Cell = tuple[int, int]  # (row, column)

_NEIGHBOURS: Final = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))
_MAX_CACHED_FIELDS: Final = 64  # trees that are kept, one per goal cell: 0.7 MB each for the office
_MAX_CACHED_WAYS: Final = 256  # finished ways that are kept, one per start cell and goal
_SPACING: Final = 0.05  # [m] between the points of a finished way
_ROUNDS: Final = 3  # of corner cutting
_SLACK: Final = 1.02  # a straight line may cost this much more than the bends it replaces
_AROUND: Final = 3.0  # [m] on each side: the area of the search for a way around moving things
_LANE_STEPS: Final = (0.1, 0.2, 0.3, 0.4)  # [m] to the right
_LANE_SPARE: Final = 0.05  # [m] beyond the lane that must be free as well
_TAPER: Final = 20  # points over which a shift grows
_DIRECTION: Final = 4  # points on each side over which the direction of a way is measured
_EVERY: Final = 3  # points of a way to be left, of which one is tested: they are 5 cm apart
_SQUEEZE: Final = 0.2  # [m] a robot this close to a moving thing may drive away from it
_RESCUE: Final = 0.5  # [m] a robot that stands too close to something may creep out


class Planner:
    """Finds ways on one costmap.

    The search runs backwards from the goal over the whole floor, so that its tree is valid for
    every start. Trees and ways of the last goals are kept, so a patrol's second round costs almost
    nothing.

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
            NavigationError: the goal is outside the map, in something solid, too close to it, or
                out of reach.
        """
        target = self.costmap.check_place(*goal)
        source = self._start_cell(start)
        with self._lock:
            way = self._ways.get((source, goal))
            if way is None:
                way = self._make_way(source, target, start, goal)
                self._ways[source, goal] = way
                if len(self._ways) > _MAX_CACHED_WAYS:
                    self._ways.popitem(last=False)
        return [start, *way[1:]]

    def around(
        self, start: Point, rest: Sequence[Point], discs: Iterable[Sighting]
    ) -> list[Point] | None:
        """Return a way that leaves `rest`, passes the moving things and comes back to it.

        Only a few metres around `start` are searched.

        Args:
            start: The robot's position.
            rest: The way from there.
            discs: The moving things, where they are now.

        Returns:
            The new way to the end of `rest`; None if there is none.
        """
        window = _Window(self.costmap.cut(start, _AROUND, discs), start)
        back = window.rejoin(rest)
        if back is None or window.source is None:
            return None
        target = window.costmap.map.row_column(*rest[back])
        _, tree = window.search(target)
        if tree[window.index(window.source)] < 0 and window.source != target:
            return None
        cells = window.walk(tree, window.index(window.source))
        return [*window.line(cells, start, rest[back]), *rest[back + 1 :]]

    def refuge(
        self, start: Point, avoid: Sequence[Point], clearance: float, discs: Iterable[Sighting]
    ) -> list[Point] | None:
        """Return the way to the nearest place that is not on another robot's way.

        Only a few metres around `start` are searched.

        Args:
            start: The robot's position.
            avoid: The other robot's way.
            clearance: The distance from it that is enough [m].
            discs: The moving things, where they are now.
        """
        window = _Window(self.costmap.cut(start, _AROUND, discs), start)
        if not avoid or window.source is None:
            return None
        grid = window.costmap.map
        rows, columns = np.mgrid[0 : grid.height, 0 : grid.width]
        x, y = grid.centres(rows, columns)
        far = np.ones(x.shape, dtype=np.bool_)
        for ax, ay in avoid[::_EVERY]:
            far &= (x - ax) ** 2 + (y - ay) ** 2 > clearance * clearance
        cost, tree = window.search(window.source)
        cost = np.where(far.ravel(), cost, np.inf)
        best = int(np.argmin(cost))
        if not math.isfinite(cost[best]):
            return None
        cells = window.walk(tree, best)
        cells.reverse()
        return window.line(cells, start, grid.centre(*cells[-1]))

    def _make_way(self, source: Cell, target: Cell, start: Point, goal: Point) -> list[Point]:
        cells = self._walk(source, target)
        corners = [self.costmap.map.centre(*cell) for cell in _straighten(self.costmap, cells)]
        if self.costmap.is_free(*start):
            corners[0] = start
        else:
            corners.insert(0, start)
        corners[-1] = goal
        return _smooth(self.costmap, corners)

    def _start_cell(self, start: Point) -> Cell:
        """Return the cell to search from: the robot's own, or the nearest free one."""
        cell = self.costmap.map.cell(*start)
        if cell is None:
            raise NavigationError(
                f"the robot at ({start[0]:.2f}, {start[1]:.2f}) is outside the map"
            )
        if not self.costmap.blocked[cell]:
            return cell
        resolution = self.costmap.map.resolution
        nearest = _nearest_free(self.costmap.blocked, cell, _RESCUE, resolution)
        if nearest is None:
            raise NavigationError(
                f"no way: the robot at ({start[0]:.2f}, {start[1]:.2f}) is shut in on all sides"
            )
        return nearest

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
        """Return for each cell the next one on the way to `target`; negative if there is none."""
        tree = self._trees.get(target)
        if tree is None:
            if self._graph is None:
                self._graph = _graph(self.costmap.blocked, self.costmap.cost)
            root = target[0] * self.costmap.map.width + target[1]
            _, tree = dijkstra(self._graph, indices=root, return_predecessors=True)
            self._trees[target] = tree
            if len(self._trees) > _MAX_CACHED_FIELDS:
                self._trees.popitem(last=False)
        else:
            self._trees.move_to_end(target)
        return tree


def keep_right(costmap: Costmap, way: list[Point]) -> list[Point]:
    """Shift a way to the right where there is space, so that two robots can pass."""
    points = np.array(way)
    if len(points) < 2 * _TAPER:
        return way
    ahead = np.roll(points, -_DIRECTION, axis=0) - np.roll(points, _DIRECTION, axis=0)
    ahead[:_DIRECTION], ahead[-_DIRECTION:] = ahead[_DIRECTION], ahead[-_DIRECTION - 1]
    length = np.hypot(ahead[:, 0], ahead[:, 1])
    length[length == 0.0] = 1.0
    right = np.column_stack((ahead[:, 1], -ahead[:, 0])) / length[:, None]
    shift = np.zeros(len(points))
    free = np.ones(len(points), dtype=np.bool_)
    for step in _LANE_STEPS:  # the farthest that can be reached through free cells
        moved = points + (step + _LANE_SPARE) * right
        free &= costmap.are_free(moved[:, 0], moved[:, 1])
        shift[free] = step
    # The shift fades out at both ends, and changes smoothly in between.
    ends = np.minimum(np.arange(len(points)), np.arange(len(points))[::-1]) / _TAPER
    shift = np.minimum(shift, _LANE_STEPS[-1] * np.clip(ends - 0.5, 0.0, 1.0))
    shift = uniform_filter1d(minimum_filter1d(shift, _TAPER), _TAPER)
    moved = points + shift[:, None] * right
    moved[0], moved[-1] = points[0], points[-1]
    if not costmap.are_free(moved[1:, 0], moved[1:, 1]).all():
        return way
    return [(float(x), float(y)) for x, y in moved]


class _Window:
    """The part of a costmap a few metres around a robot.

    Attributes:
        costmap: That part.
        source: The free cell at the robot or close to it; None if there is none.
    """

    def __init__(self, costmap: Costmap, middle: Point) -> None:
        self.costmap = costmap
        self._width = costmap.map.width
        cell = costmap.map.cell(*middle)
        self.source: Cell | None = None
        if cell is not None:
            resolution = costmap.map.resolution
            self.source = _nearest_free(costmap.blocked, cell, _SQUEEZE, resolution)

    def index(self, cell: Cell) -> int:
        """Return the index of a cell in the results of `search`."""
        return cell[0] * self._width + cell[1]

    def rejoin(self, rest: Sequence[Point]) -> int | None:
        """Return the index of the last point of a way inside; None if that point is not free."""
        found = None
        for i, point in enumerate(rest):
            cell = self.costmap.map.cell(*point)
            if cell is None:
                break
            found = None if self.costmap.blocked[cell] else i
        return found

    def search(self, root: Cell) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return for each cell the cost to reach `root`, and the next cell on the way."""
        graph = _graph(self.costmap.blocked, self.costmap.cost)
        cost, tree = dijkstra(graph, indices=self.index(root), return_predecessors=True)
        return cost, tree

    def walk(self, tree: NDArray[np.int32], node: int) -> list[Cell]:
        """Return the cells from a node of the tree to its root."""
        cells = []
        while node >= 0:
            cells.append(divmod(node, self._width))
            node = int(tree[node])
        return cells

    def line(self, cells: list[Cell], start: Point, end: Point) -> list[Point]:
        """Return a smooth way along the cells."""
        corners = [self.costmap.map.centre(*cell) for cell in _straighten(self.costmap, cells)]
        corners[0], corners[-1] = start, end
        return _smooth(self.costmap, corners)


def _straighten(costmap: Costmap, cells: list[Cell]) -> list[Cell]:
    """Replace bends by straight lines where those cost no more.

    Doubling, then bisection, finds the farthest cell: testing all cells would be quadratic.
    """
    rows, columns = np.array(cells, dtype=np.intp).T
    steps = np.hypot(np.diff(rows), np.diff(columns))
    along = costmap.cost[rows, columns]
    spent = np.concatenate(([0.0], np.cumsum(steps * (along[1:] + along[:-1]) / 2.0)))

    def may_cut(first: int, last: int) -> bool:
        allowed = float(spent[last] - spent[first]) * _SLACK
        return costmap.line_cost(cells[first], cells[last]) <= allowed

    kept, here, last = [cells[0]], 0, len(cells) - 1
    while here < last:
        jump = 1
        while jump * 2 <= last - here and may_cut(here, here + jump * 2):
            jump *= 2
        low, high = here + jump, min(here + jump * 2, last)
        while low < high:
            middle = (low + high + 1) // 2
            if may_cut(here, middle):
                low = middle
            else:
                high = middle - 1
        here = low
        kept.append(cells[here])
    return kept if len(kept) > 1 else [cells[0], cells[-1]]


def _smooth(costmap: Costmap, corners: list[Point]) -> list[Point]:
    """Cut the corners (Chaikin) as long as the way stays free, then space the points evenly."""
    points = corners
    for _ in range(_ROUNDS):
        rounder = _cut_corners(points)
        if not costmap.polyline_is_free(_space(rounder)[1:]):
            break
        points = rounder
    return _space(points)


def _nearest_free(
    blocked: NDArray[np.bool_], cell: Cell, reach: float, resolution: float
) -> Cell | None:
    """Return the free cell nearest to `cell`, `reach` [m] away at most."""
    if not blocked[cell]:
        return cell
    cells = math.ceil(reach / resolution)
    r0, c0 = max(0, cell[0] - cells), max(0, cell[1] - cells)
    rows, columns = np.nonzero(~blocked[r0 : cell[0] + cells + 1, c0 : cell[1] + cells + 1])
    if not rows.size:
        return None
    nearest = int(np.argmin(np.hypot(rows + r0 - cell[0], columns + c0 - cell[1])))
    return int(rows[nearest]) + r0, int(columns[nearest]) + c0


def _graph(blocked: NDArray[np.bool_], costs: NDArray[np.float32]) -> csr_array:
    """Return the 8-connected graph of the free cells; an edge weighs its length times its cost."""
    height, width = blocked.shape
    cost = np.pad(np.where(blocked, np.inf, costs), 1, constant_values=np.inf)
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
