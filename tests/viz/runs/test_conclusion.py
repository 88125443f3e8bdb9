"""What many runs have in common, and what is not concluded."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree as ET

import pytest

from smachpy.events.recording import read_recording
from smachpy_viz.runs import concluding_charts
from smachpy_viz.runs.conclusion import Bound, RunEnd, bounds, by_cause, end_of, headline
from smachpy_viz.runs.report import collect, report
from tests.viz.drives import run

GOOD = RunEnd(good=True)


def bad(cause="the battery is empty at 3 %", path="/P/DOCK"):
    return RunEnd(good=False, path=path, cause=cause)


def test_the_headline_says_what_all_failures_share():
    ends = [GOOD, bad("empty at 3 %"), GOOD, bad("empty at 1 %"), bad("empty at 0.5 %")]
    values = [
        {"speed": v, "seed": s} for v, s in ((0.9, 1), (0.4, 5), (0.6, 3), (0.5, 2), (0.3, 4))
    ]
    assert headline(ends, values) == (
        "2 of 5 succeeded.",
        "All 3 failures: empty at 3 % in DOCK, every one with speed up to 0.5.",
    )
    assert [numbers for _, numbers in by_cause(ends)] == [[1, 3, 4]]


def test_two_values_are_told_where_one_does_not_part_the_runs():
    points = [(1, 1), (1, 9), (2, 2), (9, 1), (9, 9), (2, 1), (2, 8), (8, 2)]
    ends = [bad() if x < 3 and y < 3 else GOOD for x, y in points]
    values = [{"x": float(x), "y": float(y)} for x, y in points]
    found = bounds(ends, [0, 2, 5], values)
    assert found == (Bound("x", 2.0, above=False), Bound("y", 2.0, above=False))
    assert headline(ends, values)[1].endswith("every one with x up to 2 and y up to 2.")


def axes(chart):
    """The names and numbers at the axes: x, y and text of each."""
    root = ET.fromstring(chart)
    texts = [one for one in root.iter("text") if one.get("class") == "axis"]
    return [(float(one.get("x")), float(one.get("y")), one.text) for one in texts]


@pytest.mark.parametrize(
    ("x", "across"),
    [
        ([1, 2, 3], ["1", "2", "3"]),  # whole numbers have no halves
        ([4.0, 4.0, 4.0], ["4"]),
        ([0.0, 40.0, 100.0], ["0", "50", "100"]),
        ([0.1, 0.45, 0.3], ["0.1", "0.2", "0.3", "0.4"]),
        ([1e6, 1.5e6, 2e6], ["1000000", "1500000", "2000000"]),
    ],
)
def test_axes_have_round_numbers_and_whole_ones_for_counts(x, across):
    chart = concluding_charts.scatter([GOOD, bad(), GOOD], [{"x": one} for one in x], ["x"], ())
    numbers = [(left, down, text) for left, down, text in axes(chart) if text not in {"x", "run"}]
    low = max(down for _, down, _ in numbers)
    assert [text for _, down, text in numbers if down == low] == across
    assert [text for _, down, text in numbers if down < low] == ["1", "2", "3"]  # the runs


def test_an_axis_of_values_without_an_end_has_no_numbers():
    values = [{"x": one} for one in (1.0, math.inf, math.nan)]
    chart = concluding_charts.scatter([GOOD, bad(), GOOD], values, ["x"], ())
    assert {text for _, _, text in axes(chart)} == {"x", "run", "1", "2", "3"}


def test_the_name_of_an_axis_touches_no_number():
    ends = [RunEnd(good=True, place=(x, y)) for x, y in ((0.0, 0.0), (5.0, 10.5), (2.0, 10.0))]
    texts = axes(concluding_charts.places(ends))
    ((_, name, _),) = [one for one in texts if one[2] == "y [m]"]
    assert min(down for _, down, text in texts if text != "y [m]") - name >= 14


@pytest.mark.parametrize(
    ("ends", "text"),
    [
        ([GOOD, GOOD], ""),
        ([GOOD, bad(), bad()], "2 failed: too few to say what they have in common."),
        ([bad("a"), bad("b"), bad("c")], "3 failed, of 3 causes: no common one."),
        (
            [GOOD, bad(), GOOD, bad(), GOOD, bad(), GOOD],
            "All 3 failures: the battery is empty at 3 % in DOCK, no common value found.",
        ),
        (
            [bad(), bad(), bad()],  # a bound that all runs keep says nothing
            "All 3 failures: the battery is empty at 3 % in DOCK, no common value found.",
        ),
    ],
)
def test_no_cause_is_claimed_that_the_runs_do_not_show(ends, text):
    values = [{"speed": float(number)} for number in range(len(ends))]
    assert headline(ends, values)[1] == text
    assert headline(ends, [{}] * len(ends))[1] == text  # nothing varied


def test_the_report_begins_with_the_conclusion_and_links_to_the_runs(tmp_path):
    values = {}
    for number, speed in enumerate([0.5, 0.3, 0.2, 0.6, 0.1]):
        path = tmp_path / f"{number}.jsonl"
        run(speed, path=path)
        values[str(path)] = {"speed": speed, "name": "<b>x"}
    runs = collect(map(read_recording, sorted(tmp_path.glob("*.jsonl"))))["JOB"]
    page = report(runs, values=values)
    text = re.sub(r"<[^>]+>", "", page)
    assert (
        "2 of 5 succeeded. All 3 failures: aborted in DRIVE, every one with speed up to 0.3."
        in text
    )
    for title in ("Failures by first cause", "What decides"):
        assert f"<h2>{title}</h2>" in page
    assert "Where they ended" not in page  # no robot
    assert set(re.findall(r'href="#(run-\d+)"', page)) <= set(re.findall(r'id="(run-\d+)"', page))
    for chart in re.findall(r'<svg class="chart.*?</svg>', page, re.DOTALL):
        ET.fromstring(chart)
    assert "<b>x" not in page


def test_nothing_decides_where_all_runs_are_good(tmp_path):
    values = {}
    for number, speed in enumerate([0.5, 0.6]):
        path = tmp_path / f"{number}.jsonl"
        run(speed, path=path)
        values[str(path)] = {"speed": speed}
    runs = collect(map(read_recording, sorted(tmp_path.glob("*.jsonl"))))["JOB"]
    page = report(runs, values=values)
    assert "2 of 2 succeeded." in re.sub(r"<[^>]+>", "", page)
    assert "<h2>What varied</h2>" in page
    assert "<h2>What decides</h2>" not in page


def test_where_a_run_ended_is_the_last_place_in_the_feedback_of_a_drive():
    record, story = run(0.3)
    position = {"$msg": "Point", "fields": {"x": 3.0, "y": 4.5, "z": 0.0}}
    pose = {"$msg": "Pose", "fields": {"position": position}}
    stamped = {"$msg": "PoseStamped", "fields": {"pose": pose}}
    feedback = {"$msg": "MoveBaseFeedback", "fields": {"base_position": stamped}}
    told = {"kind": "GoalFeedback", "path": "/JOB/DRIVE", "stamp_ns": story[-1]["stamp_ns"]}
    end = end_of(record, [*story[:-1], {**told, "feedback": feedback}, story[-1]])
    assert (end.place, end.path, end.cause) == ((3.0, 4.5), "/JOB/DRIVE", "aborted")
    ET.fromstring(concluding_charts.places([end, GOOD]))
    for odd in (None, 3, {"fields": 3}, {"fields": {"base_position": 3}}, {"fields": {}}):
        assert end_of(record, [*story, {**told, "feedback": odd}]).place is None
