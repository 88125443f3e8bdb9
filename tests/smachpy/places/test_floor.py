from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from smachpy.places.floor import Bar, Obstacle, Sighting, stamp
from smachpy.places.occupancy import OccupancyMap
from smachpy.places.pose import Pose2D
from smachpy.places.robot_file import PlannerConfig
from smachpy.sim.costmap import Costmap
from smachpy.sim.planner import Planner, keep_right

CELL = 0.1
numbers = st.floats(-5, 5)
angles = st.floats(-math.pi, math.pi)
radii = st.floats(0.02, 1.0)


def empty(origin, side=60):
    return OccupancyMap(np.zeros((side, side), dtype=np.int8), CELL, origin)


@given(numbers, numbers, numbers, numbers, radii, numbers, numbers)
def test_the_gap_to_a_bar_is_that_to_its_nearest_point(x0, y0, x1, y1, radius, x, y):
    bar = Bar(x0, y0, x1, y1, radius, "bar")
    shares = np.linspace(0.0, 1.0, 401)
    points = np.hypot(x0 + shares * (x1 - x0) - x, y0 + shares * (y1 - y0) - y)
    step = math.hypot(x1 - x0, y1 - y0) / 400
    assert points.min() - radius - step - 1e-9 <= bar.gap(x, y) <= points.min() - radius + 1e-9


@given(numbers, numbers, numbers, numbers, radii, numbers, numbers, angles)
def test_turning_and_shifting_everything_keeps_every_gap(x0, y0, x1, y1, radius, x, y, turn):
    frame = Pose2D(1.0, -2.0, turn)
    a, b, p = (frame.then(Pose2D(u, v, 0)) for u, v in ((x0, y0), (x1, y1), (x, y)))
    bar = Bar(x0, y0, x1, y1, radius, "bar")
    moved = Bar(a.x, a.y, b.x, b.y, radius, "bar")
    assert math.isclose(bar.gap(x, y), moved.gap(p.x, p.y), abs_tol=1e-6)


@given(numbers, numbers, numbers, numbers, radii, angles)
def test_stamped_cells_are_those_whose_centre_is_inside(x0, y0, x1, y1, radius, yaw):
    grid = empty(Pose2D(-3.0, -3.0, 0.0).then(Pose2D(0, 0, yaw / 10)))
    for thing in (Bar(x0, y0, x1, y1, radius, "bar"), Obstacle(x0, y0, radius)):
        solid = np.zeros(grid.cells.shape, dtype=bool)
        stamp(solid, grid, thing)
        for row in range(0, grid.height, 7):
            for column in range(0, grid.width, 7):
                gap = thing.gap(*grid.centre(row, column))
                if abs(gap) > 1e-6:
                    assert solid[row, column] == (gap < 0.0)


@given(numbers, numbers, angles, st.lists(st.tuples(st.floats(0, 6), st.floats(0, 6)), max_size=20))
def test_many_points_are_answered_as_one_is(x, y, yaw, points):
    grid = empty(Pose2D(x, y, yaw))
    grid.cells[20:30, 10:50] = 100
    costmap = Costmap(grid, 0.2, PlannerConfig())
    there = [Pose2D(x, y, yaw).then(Pose2D(u, v, 0)) for u, v in points]
    xs, ys = np.array([p.x for p in there]), np.array([p.y for p in there])
    free = costmap.are_free(xs, ys).tolist()
    assert free == [costmap.is_free(p.x, p.y) for p in there]
    assert costmap.polyline_is_free([(p.x, p.y) for p in there]) == all(free)


@settings(max_examples=40)
@given(st.floats(1.5, 4.5), st.floats(1.5, 4.5), st.floats(0.1, 0.4), angles)
def test_a_way_around_keeps_off_what_moves(x, y, radius, yaw):
    origin = Pose2D(-1.0, 2.0, yaw)

    def place(u, v):
        p = origin.then(Pose2D(u, v, 0))
        return p.x, p.y

    planner = Planner(Costmap(empty(origin), 0.2, PlannerConfig()))
    seen = Sighting(*place(x, y), radius, "somebody")
    start = place(0.7, 3.0)
    straight = [place(0.7 + 0.05 * i, 3.0) for i in range(93)]
    if math.dist((x, y), (0.7, 3.0)) < radius + 0.5:
        return
    way = planner.around(start, straight, [seen])
    if way is None:
        assert math.dist((x, y), (3.7, 3.0)) < radius + 1.0
        return
    assert way[0] == start
    free_until = next(
        (i for i, p in enumerate(way) if math.dist(p, start) > 2.6), len(way)
    )  # beyond, the old way is kept
    for point in way[:free_until]:
        assert math.dist(point, (seen.x, seen.y)) > radius + 0.2 - CELL


@given(st.floats(2.0, 4.0), angles)
def test_a_refuge_is_off_the_way(v, yaw):
    origin = Pose2D(3.0, 3.0, yaw)

    def place(u, v):
        p = origin.then(Pose2D(u, v, 0))
        return p.x, p.y

    planner = Planner(Costmap(empty(origin), 0.2, PlannerConfig()))
    theirs = [place(0.5 + 0.05 * i, v) for i in range(80)]
    way = planner.refuge(place(3.0, v), theirs, 0.6, ())
    assert way is not None
    assert way[0] == place(3.0, v)
    assert min(math.dist(way[-1], p) for p in theirs) > 0.6 - CELL
    assert math.dist(way[0], way[-1]) < 0.6 + 3 * CELL


@given(angles)
def test_it_keeps_to_the_right_whichever_way_it_drives(heading):
    middle = Pose2D(0.0, 0.0, heading)
    start = middle.then(Pose2D(-8.0, -8.0, 0.0))
    grid = empty(Pose2D(start.x, start.y, heading), side=160)
    costmap = Costmap(grid, 0.2, PlannerConfig())
    points = [middle.then(Pose2D(-4.0 + 0.05 * i, 0.0, 0.0)) for i in range(161)]
    way = [(p.x, p.y) for p in points]
    shifted = keep_right(costmap, way)
    assert (shifted[0], shifted[-1]) == (way[0], way[-1])
    right = middle.then(Pose2D(0.0, -0.4, 0.0))
    assert math.dist(shifted[80], (right.x, right.y)) < 0.01


def test_in_a_narrow_place_it_keeps_to_the_middle():
    grid = empty(Pose2D(0, 0, 0))
    grid.cells[:26], grid.cells[34:] = 100, 100
    costmap = Costmap(grid, 0.2, PlannerConfig())
    way = [(0.5 + 0.05 * i, 3.0) for i in range(100)]
    assert max(abs(y - 3.0) for _, y in keep_right(costmap, way)) < 0.11
