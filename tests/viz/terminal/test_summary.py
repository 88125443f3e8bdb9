from __future__ import annotations

import io

from rich.console import Console

from smachpy import events as ev
from smachpy_viz.model.history import History
from smachpy_viz.terminal.summary import summary


def printed(record, history, outcome, rows=40, width=100):
    file = io.StringIO()
    Console(file=file, width=width).print(
        summary(record, history, outcome, rows, narrow=width < 72)
    )
    return [line.rstrip() for line in file.getvalue().splitlines()]


def patrolled():
    history = History()
    for event in [
        ev.Started("/PATROL", 0.0, 0),
        ev.Entered("/PATROL/CHARGE", 0.0, 0),
        ev.Entered("/PATROL/CHARGE/DOCK", 0.0, 0),
        ev.Left("/PATROL/CHARGE/DOCK", 2.0, 0, "aborted"),
        ev.Entered("/PATROL/CHARGE/DOCK", 2.0, 0),
        ev.Left("/PATROL/CHARGE/DOCK", 3.0, 0, "succeeded"),
        ev.Left("/PATROL/CHARGE", 3.0, 0, "succeeded"),
        ev.Finished("/PATROL", 3.5, 0, "succeeded"),
    ]:
        history.on_event(event)
    return history


def test_the_table_has_state_outcome_duration_and_times(patrol):
    lines = printed(patrol, patrolled(), "succeeded")
    assert [line.split() for line in lines if line] == [
        ["state", "outcome", "duration", "times"],
        ["CHARGE", "succeeded", "3.00", "s"],
        ["DOCK", "aborted,", "succeeded", "3.00", "s", "\u00d72"],
        ["PATROL:", "succeeded", "after", "3.50", "s"],
    ]


def test_a_long_table_leaves_the_innermost_levels_out(patrol):
    lines = printed(patrol, patrolled(), "succeeded", rows=1)
    assert not any("DOCK" in line for line in lines)
    assert "(1 deeper states left out)" in lines


def test_a_mission_that_raised_says_so(patrol):
    assert printed(patrol, History(), None)[-1] == "PATROL: exception"


def test_forty_columns_cut_no_outcome_and_no_time(patrol):
    lines = printed(patrol, patrolled(), "succeeded", width=40)
    text = " ".join(lines)
    for words in ("CHARGE", "DOCK", "aborted", "succeeded", "3.0 s", "\u00d72"):
        assert words in text
    assert "\u2026" not in text
    assert max(map(len, lines)) <= 40
