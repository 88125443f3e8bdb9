from __future__ import annotations

import math

import numpy as np
import pytest

from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from smachpy.places.occupancy import FREE, OCCUPIED, UNKNOWN, load_map
from smachpy.places.pose import Pose2D
from smachpy.sim.raycast import Raycaster
from smachpy_missions.explore.map_file import write_map
from smachpy_missions.explore.scans import rays_of
from smachpy_missions.explore.seen_map import Frontier, SeenMap


def flat(*ranges, range_max=5.0):
    """A scan all around, the first ray straight on."""
    step = 2 * math.pi / len(ranges)
    return LaserScan(angle_increment=step, range_min=0.1, range_max=range_max, ranges=list(ranges))


def cell(grid, x, y):
    where = grid.cell(x, y)
    return UNKNOWN if where is None else int(grid.cells[where])


def test_a_ray_shows_free_floor_and_a_wall():
    seen = SeenMap()
    seen.add(flat(2.0, math.inf, 1.0, math.nan), Pose2D(3.0, 4.0, 0.0))
    grid = seen.occupancy()
    assert cell(grid, 3.05, 4.05) == FREE
    assert cell(grid, 4.5, 4.05) == FREE
    assert cell(grid, 5.05, 4.05) == OCCUPIED
    assert cell(grid, 6.0, 4.05) == UNKNOWN
    assert cell(grid, 3.05, 8.5) == FREE  # nothing there, as far as it reaches
    assert cell(grid, 3.05, 3.5) == UNKNOWN  # this ray says nothing
    assert 0.5 < seen.area() < 1.5


def test_rays_follow_the_heading_of_the_robot():
    rays = rays_of(flat(2.0, 9.0, 0.05, -1.0), Pose2D(1.0, 1.0, math.pi / 2))
    assert list(rays.hits) == [True, False]
    xs, ys = rays.ends(math.inf)
    assert xs == pytest.approx([1.0, -4.0])
    assert ys == pytest.approx([3.0, 1.0])


def test_a_person_who_has_gone_does_not_stay_on_the_map():
    seen = SeenMap()
    seen.add(flat(1.0), Pose2D(0.0, 0.0, 0.0))
    assert cell(seen.occupancy(), 1.05, 0.05) == OCCUPIED
    for _ in range(4):
        seen.add(flat(3.0), Pose2D(0.0, 0.0, 0.0))
    assert cell(seen.occupancy(), 1.05, 0.05) == FREE


def test_it_grows_to_all_sides_and_keeps_what_it_knew():
    seen = SeenMap()
    seen.add(flat(1.0, 1.0, 1.0, 1.0), Pose2D(0.0, 0.0, 0.0))
    for x, y in ((30.0, 0.0), (-30.0, 0.0), (0.0, 30.0), (0.0, -30.0)):
        seen.add(flat(2.0, 2.0, 2.0, 2.0), Pose2D(x, y, 0.0))
    grid = seen.occupancy()
    for x, y in ((1.05, 0.05), (32.05, 0.05), (-27.95, 0.05), (0.05, 32.05), (0.05, -27.95)):
        assert cell(grid, x, y) == OCCUPIED
    assert cell(grid, 15.0, 15.0) == UNKNOWN


def test_a_scan_without_a_ray_changes_nothing():
    seen = SeenMap()
    seen.add(flat(math.nan, math.nan), Pose2D(0.0, 0.0, 0.0))
    assert seen.area() == 0.0
    assert seen.best_frontier(Pose2D(0.0, 0.0, 0.0)) is None


@pytest.fixture(scope="module")
def look(office):
    """`look(pose)`: what a scanner on the office floor sees."""
    caster = Raycaster(office)
    bearings = np.arange(360) * math.tau / 360

    def scan(pose):
        ranges = caster.cast(pose.x, pose.y, pose.yaw + bearings, 8.0)
        return flat(*ranges, range_max=8.0)

    return scan


def test_a_frontier_is_a_place_to_stand_that_looks_into_the_unseen(office, look):
    seen, here = SeenMap(), Pose2D(9.8, 7.7, 0.0)
    seen.add(look(here), here)
    frontier = seen.best_frontier(here)
    assert frontier.size >= 1.0
    assert cell(seen.occupancy(), *frontier.pose[:2]) == FREE
    assert math.dist(frontier.pose[:2], frontier.border) <= 1.5
    x, y = frontier.border
    around = [
        cell(seen.occupancy(), x + dx, y + dy) for dx in (-0.1, 0, 0.1) for dy in (-0.1, 0, 0.1)
    ]
    assert UNKNOWN in around


@pytest.mark.slow
def test_looking_from_frontier_to_frontier_shows_the_whole_office(office, look):
    """It ends, every goal is a place where the robot fits, and little stays unseen."""
    seen, here = SeenMap(), Pose2D(9.8, 7.7, 0.0)
    seen.add(look(here), here)
    goals = 0
    while (frontier := seen.best_frontier(here)) is not None:
        goals += 1
        here = frontier.pose
        assert office.cells[office.cell(here.x, here.y)] == FREE
        seen.add(look(here), here)
        seen.leave(frontier, reached=True)
    assert 30 < goals < 150
    free = float((office.cells == FREE).sum()) * office.resolution**2
    assert seen.area() > 0.8 * free
    assert cell(seen.occupancy(), 0.2, 0.2) == UNKNOWN  # outside the walls


def test_a_place_out_of_reach_is_not_offered_again_but_another_for_the_same_border():
    seen, here = SeenMap(), Pose2D(0.0, 0.0, 0.0)
    seen.add(flat(*[math.inf] * 90, range_max=1.5), here)
    tried = []
    while (frontier := seen.best_frontier(here)) is not None:
        tried.append(frontier)
        seen.leave(frontier, reached=False)
    places = [frontier.pose[:2] for frontier in tried]
    assert 4 < len(places) < 30
    assert min(math.dist(a, b) for i, a in enumerate(places) for b in places[:i]) > 0.5


def test_a_frontier_behind_a_wall_has_no_place_on_this_side():
    """The room is closed: what lies behind its wall is no reason to stand before it."""
    seen, here = SeenMap(smallest=0.3), Pose2D(0.0, 0.0, 0.0)
    box = [1.5 / max(abs(math.cos(a)), abs(math.sin(a))) for a in np.arange(720) * math.tau / 720]
    seen.add(flat(*box, range_max=8.0), here)
    assert seen.best_frontier(here) is None


def test_the_map_can_be_written_and_read_as_any_map(tmp_path, look):
    seen, here = SeenMap(), Pose2D(9.8, 7.7, 0.3)
    seen.add(look(here), here)
    path = tmp_path / "new" / "it's mine.yaml"
    write_map(path, seen.occupancy())
    grid, known = load_map(path), seen.occupancy()
    assert grid.resolution == known.resolution
    for x in np.arange(5.05, 15.0, 0.3):
        for y in np.arange(5.05, 10.0, 0.3):
            assert cell(grid, x, y) == cell(known, x, y)
    assert grid.cells.size < known.cells.size  # the unknown margins are gone
    assert (grid.cells[0] != UNKNOWN).any()


def test_leaving_makes_room_for_nothing_else():
    seen = SeenMap()
    seen.leave(Frontier(Pose2D(0, 0, 0), (0.0, 0.0), 1.0), reached=True)
    assert seen.area() == 0.0
