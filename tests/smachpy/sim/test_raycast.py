from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from smachpy.places.floor import Bar, Obstacle
from smachpy.places.occupancy import OccupancyMap
from smachpy.places.pose import ORIGIN, Pose2D
from smachpy.sim.raycast import Raycaster, cast_at

CELL = 0.1
ANGLES = np.linspace(-math.pi, math.pi, 61)
places = st.floats(0.2, 3.7)
angles = st.floats(-math.pi, math.pi)


def room(origin=ORIGIN):
    """4 x 4 m, walls of one cell all around."""
    cells = np.zeros((40, 40), dtype=np.int8)
    cells[0, :] = cells[-1, :] = cells[:, 0] = cells[:, -1] = 100
    return OccupancyMap(cells, CELL, origin)


def to_wall(x, y, angle):
    """The exact distance to the inner faces of the walls."""
    found = []
    for at, direction in ((x, math.cos(angle)), (y, math.sin(angle))):
        if direction > 1e-12:
            found.append((3.9 - at) / direction)
        elif direction < -1e-12:
            found.append((0.1 - at) / direction)
    return min(found)


@given(places, places, angles)
def test_a_ray_ends_at_the_wall(x, y, angle):
    (distance,) = Raycaster(room()).cast(x, y, np.array([angle]), 10.0)
    assert to_wall(x, y, angle) - 1e-6 <= distance <= to_wall(x, y, angle) + CELL * 0.75


@given(places, places, angles, st.floats(-7, 7), st.floats(-7, 7), angles)
def test_a_turned_and_shifted_map_gives_the_same_ranges(x, y, angle, ox, oy, yaw):
    origin = Pose2D(ox, oy, yaw)
    there = origin.then(Pose2D(x, y, 0))
    (plain,) = Raycaster(room()).cast(x, y, np.array([angle]), 10.0)
    (moved,) = Raycaster(room(origin)).cast(there.x, there.y, np.array([angle + yaw]), 10.0)
    assert moved == pytest.approx(plain, abs=CELL * 0.8)


def test_beyond_its_reach_a_ray_meets_nothing():
    ranges = Raycaster(room()).cast(2.0, 2.0, ANGLES, 1.5)
    assert np.isinf(ranges).all()


def test_outside_the_map_nothing_is_seen():
    assert np.isinf(Raycaster(room()).cast(-1.0, 2.0, ANGLES, 5.0)).all()


def test_the_edge_of_the_map_ends_a_ray():
    grid = OccupancyMap(np.zeros((10, 10), dtype=np.int8), CELL, Pose2D(0, 0, 0))
    (distance,) = Raycaster(grid).cast(0.5, 0.5, np.array([0.0]), 5.0)
    assert distance == pytest.approx(0.5, abs=CELL)


@given(angles, st.floats(0.05, 1.0), st.floats(0.1, 5.0), angles)
def test_a_disc_is_met_on_its_surface(direction, radius, gap, bearing):
    x, y = (radius + gap) * math.cos(direction), (radius + gap) * math.sin(direction)
    disc = Obstacle(x, y, radius)
    (straight, other) = cast_at([disc], 0.0, 0.0, np.array([direction, bearing]))
    assert straight == pytest.approx(gap, abs=1e-6)
    if math.isfinite(other):
        assert disc.gap(other * math.cos(bearing), other * math.sin(bearing)) == pytest.approx(
            0.0, abs=1e-6
        )


@given(*[st.floats(-3, 3)] * 4, angles)
def test_a_bar_is_met_on_its_surface_or_not_at_all(x0, y0, x1, y1, bearing):
    bar = Bar(x0, y0, x1, y1, 0.1, "bar")
    assume(bar.gap(0.0, 0.0) > 1e-3)
    assume(math.hypot(x1 - x0, y1 - y0) > 1e-6)
    (distance,) = cast_at([bar], 0.0, 0.0, np.array([bearing]))
    steps = np.arange(0.0, 6.0, 0.01)
    gaps = [bar.gap(t * math.cos(bearing), t * math.sin(bearing)) for t in steps]
    inside = [t for t, gap in zip(steps, gaps, strict=True) if gap < -1e-6]
    if math.isfinite(distance):
        there = bar.gap(distance * math.cos(bearing), distance * math.sin(bearing))
        assert there == pytest.approx(0.0, abs=1e-5)
        assert not inside or inside[0] >= distance - 1e-6
    else:
        assert not inside


def test_inside_something_a_ray_ends_at_once():
    assert cast_at([Bar(-1, 0, 1, 0, 0.1, "b")], 0.0, 0.0, ANGLES).tolist() == [0.0] * len(ANGLES)


@given(places, places, places, places)
def test_sight_is_mutual_in_an_empty_room(x0, y0, x1, y1):
    rays = Raycaster(room())
    assert rays.sees(x0, y0, np.array([(x1, y1)])).all()


def test_a_wall_hides_what_is_behind_it():
    grid = room()
    grid.cells[20, :30] = 100
    rays = Raycaster(grid)
    seen = rays.sees(1.0, 1.0, np.array([(1.0, 3.0), (1.0, 1.8), (3.5, 3.5)]))
    assert seen.tolist() == [False, True, False]
