"""How a run that failed differs from good ones at the state that failed."""

from __future__ import annotations

import json

from smachpy_viz.runs.good_runs import compare_with_good
from tests.viz.drives import GOOD, run


def test_the_value_that_no_good_run_had_is_told_and_others_are_not():
    found = compare_with_good(*run(0.3), map(run, GOOD))
    assert (found.path, found.runs) == ("/JOB/DRIVE", 4)
    speed, place, took = found.facts
    assert (speed.name, speed.number, sorted(speed.good), speed.differs) == (
        "speed",
        0.3,
        GOOD,
        True,
    )
    assert (place.name, place.texts, place.differs) == ("place", ["'dock'"], False)
    assert (took.unit, round(took.number, 2), took.differs) == ("s", 16.67, True)
    assert found.text == (
        "unlike 4 good runs: speed 0.3 (good: 0.5 to 0.6), took 16.7 s (good: 8.333 to 10 s)"
    )
    other_place = compare_with_good(*run(0.3, "kitchen"), map(run, GOOD))
    assert other_place.facts[1].differs
    json.dumps(found.to_json())


def test_no_cause_is_claimed_under_three_good_runs():
    found = compare_with_good(*run(0.3), map(run, GOOD[:2]))
    assert not any(fact.differs for fact in found.facts)
    assert found.text == "2 good run(s) with this state; at least 3 are compared"
    assert "no good run" in compare_with_good(*run(0.3), []).text
    assert compare_with_good(*run(0.3)[:1], [], []).path == ""


def test_what_is_as_in_good_runs_is_said_to_be():
    found = compare_with_good(*run(0.41), map(run, [0.41, 0.5, 0.6, 0.41]))
    assert "no state is known to have failed" in found.text or found.text.startswith("as in 4 good")
