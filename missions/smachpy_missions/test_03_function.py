"""Lesson 3: one test for several values."""

import pytest

from smachpy_missions.lesson_03_function import battery_check


@pytest.mark.parametrize(
    ("charge", "outcome", "advice"),
    [(1.0, "succeeded", "go"), (0.2, "succeeded", "go"), (0.1, "aborted", "charge first")],
)
def test_the_charge_decides(mission, charge, outcome, advice):
    run = mission(battery_check(charge=charge))
    run.assert_outcome(outcome)
    run.assert_userdata(advice=advice)
