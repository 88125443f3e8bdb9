from __future__ import annotations

import numpy as np
from PIL import Image

from smachpy.places.occupancy import OccupancyMap
from smachpy.places.pose import Pose2D
from smachpy.sim.track import GoalMark, draw_track, draw_tracks


def test_the_picture_shows_track_goals_and_dock(tmp_path):
    grid = OccupancyMap(np.zeros((80, 120), dtype=np.int8), 0.05, Pose2D(0, 0, 0))
    track = [(1 + i / 50, 2.0) for i in range(150)]
    goals = [
        GoalMark(Pose2D(4.0, 2.0, 0.0), "east", reached=True),
        GoalMark(Pose2D(2.0, 3.3, 1.0), "north", reached=False),
    ]
    path = tmp_path / "track.png"
    draw_track(path, grid, track, goals, dock=Pose2D(1, 1, 0), title="done")
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert picture.shape[1] == 1600

    def count(colour):
        return int((np.abs(picture - np.array(colour)).sum(axis=2) < 20).sum())

    assert count((46, 125, 50)) > 500
    assert count((176, 60, 60)) > 500
    assert count((255, 236, 179)) > 500
    at_start = picture[round((4.0 - 2.0) / 4.0 * 1067), round(1.1 / 6.0 * 1600)]
    assert np.abs(at_start - np.array((38, 103, 191))).sum() < 40


def test_an_empty_drive_is_drawn_too(tmp_path):
    grid = OccupancyMap(np.full((8, 12), -1, dtype=np.int8), 0.5, Pose2D(1, 1, 0.5))
    draw_track(tmp_path / "track.png", grid, [], [])
    assert (tmp_path / "track.png").stat().st_size > 1000


def test_each_robot_has_its_colour_and_a_lost_one_a_cross(tmp_path):
    grid = OccupancyMap(np.zeros((80, 120), dtype=np.int8), 0.05, Pose2D(0, 0, 0))
    ways = {f"robot_{n}": [(1 + i / 50, 0.5 + 0.5 * n) for i in range(150)] for n in range(6)}
    ways["robot_6"] = []  # it never said where it was
    path = tmp_path / "tracks.png"
    docks = [Pose2D(1, 1, 0), Pose2D(5, 1, 0)]
    draw_tracks(path, grid, ways, lost={"robot_1"}, docks=docks, title="fleet")
    picture = np.asarray(Image.open(path).convert("RGB")).astype(int)

    def count(colour, part=picture):
        return int((np.abs(part - np.array(colour)).sum(axis=2) < 20).sum())

    assert count((31, 119, 180)) > 5000
    assert count((230, 97, 1)) > 5000
    assert count((255, 236, 179)) > 2000
    x, y = round(3.98 / 6.0 * 1600), round((4.0 - 1.0) / 4.0 * 1067)
    assert count((40, 44, 52), picture[y - 60 : y + 60, x - 60 : x + 60]) > 500  # the cross
    y = round((4.0 - 0.5) / 4.0 * 1067)
    assert count((40, 44, 52), picture[y - 60 : y + 60, x - 60 : x + 60]) < 50
