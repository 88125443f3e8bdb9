from __future__ import annotations

import pytest

from smachpy_viz.pictures import curves

LINE = "e,30,0 0,0 10,0 20,0 30,0"


def test_trace_follows_a_straight_curve():
    assert curves.trace(LINE, 2) == [(0, 0), (15, 0), (30, 0)]
    assert curves.length(curves.trace(LINE)) == pytest.approx(30)


def test_shift_moves_every_point():
    assert curves.shift("e,1,2 3.5,-4", 10, 20) == "e,11.00,22.00 13.50,16.00"


def test_shift_reads_small_numbers():
    assert curves.shift("1e-05,-2.5e+01", 1, 1) == "1.00,-24.00"


def test_crossings_are_counted_once_each():
    across = [(15.0, -5.0), (15.0, 5.0)]
    beside = [(40.0, -5.0), (40.0, 5.0)]
    line = [(0.0, 0.0), (30.0, 0.0)]
    assert curves.crossings([line, across, beside]) == 1
    assert curves.crossings([line, line]) == 0


def test_a_stem_goes_before_the_curve_and_keeps_its_arrow():
    assert (
        curves.with_stem(LINE, 0, 30)
        == "e,30,0 0.00,30.00 0.00,20.00 0.00,10.00 0,0 10,0 20,0 30,0"
    )


def test_a_way_round_goes_down_right_up_and_back():
    curve = curves.around((10, 50), (100, 80), 120, 40, 6)
    line = curves.trace(curve)
    assert line[0] == (10, 50)
    assert min(y for _, y in line) == pytest.approx(40)
    assert max(x for x, _ in line) == pytest.approx(120)
    assert line[-1] == (pytest.approx(100 + curves.ARROW), 80)
    assert curve.startswith("e,100.00,80.00 ")
