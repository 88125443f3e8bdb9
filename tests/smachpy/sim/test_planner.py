from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from smachpy.places.exceptions import NavigationError
from smachpy.places.floor import Obstacle
from smachpy.places.maps import OFFICE_MAP
from smachpy.places.occupancy import OccupancyMap, load_map
from smachpy.places.pose import ORIGIN, Pose2D
from smachpy.places.robot_file import PlannerConfig
from smachpy.sim.costmap import Costmap
from smachpy.sim.planner import Planner


def hall(width=6.0, height=4.0, origin=ORIGIN, resolution=0.05):
    return OccupancyMap(
        np.zeros((round(height / resolution), round(width / resolution)), dtype=np.int8),
        resolution,
        origin,
    )


@pytest.fixture(scope="module")
def office():
    return Planner(Costmap(load_map(OFFICE_MAP), 0.25, PlannerConfig()))


def test_the_body_keeps_clear_of_walls_by_its_radius():
    costmap = Costmap(hall(), 0.25, PlannerConfig(margin=0.05))
    assert not costmap.is_free(0.25, 2.0)
    assert costmap.is_free(0.4, 2.0)
    assert costmap.touches(0.1, 2.0)
    assert not costmap.touches(0.3, 2.0)
    assert not costmap.is_free(-1.0, 2.0)
    assert costmap.touches(-1.0, 2.0)


def test_unknown_floor_is_solid_unless_the_config_says_otherwise():
    grid = hall()
    grid.cells[:, 60:] = -1
    with pytest.raises(NavigationError, match="in a wall or another solid thing"):
        Costmap(grid, 0.2, PlannerConfig()).check_place(5, 2)
    assert Costmap(grid, 0.2, PlannerConfig(unknown_is_free=True)).check_place(5, 2) == (40, 100)


def test_a_place_is_judged_as_the_costmap_does(office):
    costmap = office.costmap
    generator = np.random.default_rng(1)
    for row, column in generator.integers((0, 0), costmap.blocked.shape, (3000, 2)):
        try:
            costmap.check_place(*costmap.map.centre(row, column))
        except NavigationError:
            assert costmap.blocked[row, column]
        else:
            assert not costmap.blocked[row, column]


def test_cost_falls_with_the_distance_from_walls():
    costmap = Costmap(hall(), 0.25, PlannerConfig(wall_distance=1.0, wall_weight=4.0))
    row = costmap.cost[40, 8:60]
    assert (np.diff(row) <= 0).all()
    assert row[-1] == 1.0
    assert row[0] > 3.0
    flat = Costmap(hall(), 0.25, PlannerConfig(wall_weight=0.0))
    assert (flat.cost == 1.0).all()


def test_a_way_is_free_dense_and_joins_start_and_goal(office):
    start, goal = (9.8, 7.1), (24.3, 10.5)
    way = office.plan(start, goal)
    assert (way[0], way[-1]) == (start, goal)
    assert office.costmap.polyline_is_free(way)
    assert max(math.dist(a, b) for a, b in pairwise(way)) < 0.12
    length = sum(math.dist(a, b) for a, b in pairwise(way))
    assert math.dist(start, goal) < length < 1.3 * math.dist(start, goal)


def test_a_way_in_the_open_is_a_straight_line():
    planner = Planner(Costmap(hall(), 0.2, PlannerConfig(wall_weight=0.0)))
    way = planner.plan((0.5, 0.5), (5.5, 3.3))
    length = sum(math.dist(a, b) for a, b in pairwise(way))
    assert length == pytest.approx(math.dist((0.5, 0.5), (5.5, 3.3)), rel=0.01)


def test_a_turned_and_shifted_map_gives_the_same_way():
    turned = Pose2D(3.0, -2.0, 0.7)
    plain = Planner(Costmap(hall(), 0.2, PlannerConfig()))
    moved = Planner(Costmap(hall(origin=turned), 0.2, PlannerConfig()))
    start, goal = turned.then(Pose2D(1, 1, 0)), turned.then(Pose2D(5, 3, 0))
    way = moved.plan((start.x, start.y), (goal.x, goal.y))
    expected = [turned.then(Pose2D(x, y, 0)) for x, y in plain.plan((1, 1), (5, 3))]
    assert len(way) == pytest.approx(len(expected), abs=3)
    for x, y in way:
        assert min(math.hypot(x - p.x, y - p.y) for p in expected) < 0.08


def test_the_way_bends_around_an_obstacle_by_more_than_the_radii():
    obstacle = Obstacle(3.0, 2.0, 0.4)
    planner = Planner(Costmap(hall(), 0.25, PlannerConfig(), [obstacle]))
    way = planner.plan((0.6, 2.0), (5.4, 2.0))
    assert min(math.dist((obstacle.x, obstacle.y), p) for p in way) > 0.65


@pytest.mark.parametrize(
    ("goal", "text"),
    [
        ((99.0, 0.0), r"goal \(99.00, 0.00\) is outside the map of 27 x 17 m"),
        ((0.5, 5.0), "in a wall"),
        ((0.75, 5.0), "too near to a wall: the robot needs 0.28 m"),
    ],
)
def test_goals_where_it_cannot_stand_are_refused(office, goal, text):
    with pytest.raises(NavigationError, match=text):
        office.plan((9.8, 7.1), goal)


def test_no_way_is_said():
    grid = hall()
    grid.cells[:, 60] = 100
    with pytest.raises(NavigationError, match="no way to"):
        Planner(Costmap(grid, 0.2, PlannerConfig())).plan((1, 2), (5, 2))


def test_a_robot_that_stands_too_near_to_something_creeps_out():
    planner = Planner(Costmap(hall(), 0.25, PlannerConfig()))
    way = planner.plan((0.2, 2.0), (5.0, 2.0))
    assert way[0] == (0.2, 2.0)
    grid = hall()
    grid.cells[:, :] = 100
    grid.cells[38:42, 98:102] = 0
    with pytest.raises(NavigationError):
        Planner(Costmap(grid, 0.25, PlannerConfig())).plan((1, 2), (5, 2))


def test_a_known_goal_is_planned_without_a_new_search(office):
    first = office.plan((9.8, 7.1), (2.0, 3.0))
    trees = len(office._trees)
    assert office.plan((9.8, 7.1), (2.0, 3.0)) == first
    office.plan((12.0, 7.8), (2.0, 3.0))
    assert len(office._trees) == trees
