from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from smachpy.places.exceptions import InputFileError
from smachpy.places.maps import OFFICE_MAP
from smachpy.places.occupancy import OccupancyMap, load_map
from smachpy.places.pose import Pose2D

HEAD = "resolution: 0.5\norigin: [1, 2, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def write(tmp_path, image, text="", negate=0, head=HEAD):
    path = tmp_path / "m.yaml"
    path.write_text(f"image: {image}\n{head}negate: {negate}\n{text}")
    return path


def pgm(tmp_path, rows, name="m.pgm"):
    body = "\n".join(" ".join(map(str, row)) for row in rows)
    (tmp_path / name).write_text(f"P2\n# by hand\n{len(rows[0])} {len(rows)}\n255\n{body}\n")
    return name


def test_shades_become_free_unknown_and_occupied_with_the_last_row_at_the_bottom(tmp_path):
    grid = load_map(write(tmp_path, pgm(tmp_path, [[254, 205, 0], [0, 254, 254]])))
    assert grid.cells.tolist() == [[100, 0, 0], [0, -1, 100]]
    assert (grid.width, grid.height, grid.resolution) == (3, 2, 0.5)
    assert grid.origin == Pose2D(1, 2, 0)


def test_negate_turns_black_into_free(tmp_path):
    grid = load_map(write(tmp_path, pgm(tmp_path, [[255, 0]]), negate=1))
    assert grid.cells.tolist() == [[100, 0]]


def test_scale_keeps_the_shades_between_the_thresholds(tmp_path):
    grid = load_map(write(tmp_path, pgm(tmp_path, [[254, 148, 0]]), "mode: scale\n"))
    free, between, occupied = grid.cells[0].tolist()
    assert (free, occupied) == (0, 100)
    share = (255 - 148) / 255
    assert between == int(1 + 98 * (share - 0.196) / (0.65 - 0.196))


def test_raw_takes_the_shades_as_they_are(tmp_path):
    grid = load_map(write(tmp_path, pgm(tmp_path, [[0, 42, 100, 101, 255]]), "mode: raw\n"))
    assert grid.cells.tolist() == [[0, 42, 100, -1, -1]]


@pytest.mark.parametrize("mode", ["L", "1", "P", "RGB", "RGBA", "I;16"])
def test_png_of_every_colour_mode(tmp_path, mode):
    shades = np.array([[255, 0]], dtype=np.uint8)
    image = Image.fromarray(shades)
    image = (
        Image.fromarray(shades.astype(np.uint16) * 257) if mode == "I;16" else image.convert(mode)
    )
    image.save(tmp_path / "m.png")
    assert load_map(write(tmp_path, "m.png")).cells.tolist() == [[0, 100]]


def test_binary_pgm_and_sixteen_bits(tmp_path):
    (tmp_path / "a.pgm").write_bytes(b"P5\n# c\n2 1\n255\n\xff\x00")
    (tmp_path / "b.pgm").write_bytes(b"P5\n2 1\n65535\n\xff\xff\x00\x00")
    assert load_map(write(tmp_path, "a.pgm")).cells.tolist() == [[0, 100]]
    assert load_map(write(tmp_path, "b.pgm")).cells.tolist() == [[0, 100]]


def test_transparent_cells_are_unknown_in_scale_mode(tmp_path):
    pixels = np.array([[[148, 148, 148, 255], [148, 148, 148, 0]]], dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "m.png")
    cells = load_map(write(tmp_path, "m.png", "mode: scale\n")).cells
    assert 0 < cells[0, 0] < 100
    assert cells[0, 1] == -1


@pytest.mark.parametrize(
    ("change", "field"),
    [
        (("0.5", "-0.5"), "resolution"),
        (("[1, 2, 0]", "[1, 2]"), "origin"),
        (("0.65", "1.65"), "occupied_thresh"),
        (("0.196", "0.9"), "free_thresh"),
        (("resolution: 0.5\n", ""), "resolution"),
    ],
)
def test_a_bad_field_is_named(tmp_path, change, field):
    path = write(tmp_path, pgm(tmp_path, [[0]]), head=HEAD.replace(*change))
    with pytest.raises(InputFileError) as error:
        load_map(path)
    (problem,) = error.value.problems
    assert problem.field == field
    assert problem.file == str(path)


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "No such file"),
        (b"hello", "no image"),
        (b"P5\n4 4\n255\n\x00", "m.pgm"),
        (b"P2\n2 2\n255\n1 2 x 4\n", "m.pgm"),
    ],
)
def test_a_bad_image_is_named_with_the_line_that_asks_for_it(tmp_path, content, text):
    if content is not None:
        (tmp_path / "m.pgm").write_bytes(content)
    with pytest.raises(InputFileError, match=text) as error:
        load_map(write(tmp_path, "m.pgm"))
    (problem,) = error.value.problems
    assert (problem.line, problem.field) == (1, "image")


@given(
    st.floats(-10, 10), st.floats(-10, 10), st.floats(-7, 7), st.integers(0, 4), st.integers(0, 6)
)
def test_cells_and_points_agree_whatever_the_origin(x, y, yaw, row, column):
    grid = OccupancyMap(np.zeros((5, 7), dtype=np.int8), 0.25, Pose2D(x, y, yaw))
    assert grid.cell(*grid.centre(row, column)) == (row, column)
    outside = Pose2D(x, y, yaw).then(Pose2D(-0.1, 0.3, 0))
    assert grid.cell(outside.x, outside.y) is None
    assert grid.cell(1e308, -1e308) is None  # further away than a row's number can be computed


def test_the_office_is_large_enough_and_closed():
    grid = load_map(OFFICE_MAP)
    assert grid.width * grid.resolution >= 25
    assert grid.height * grid.resolution >= 15
    assert grid.resolution == 0.05
    free = grid.cells == 0
    for edge in (free[0], free[-1], free[:, 0], free[:, -1]):
        assert not edge.any()
    assert math.isclose(free.mean(), 0.75, abs_tol=0.1)
