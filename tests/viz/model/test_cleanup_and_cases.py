"""What pictures and `why` show of clean-ups and of conditions of transitions."""

from __future__ import annotations

import smachpy
from actionlib_core.clock import VirtualClock
from smachpy import StateMachine, when
from smachpy.events import from_record, to_record
from smachpy_viz.model.extract import extract
from smachpy_viz.model.why import why
from smachpy_viz.runs.listing import RowFold
from smachpy_viz.terminal.lines import EventLines
from smachpy_viz.terminal.panel import TerminalView


@smachpy.state(["done", "failed"], output_keys=["level"])
def work(userdata):
    userdata.level = 0.1
    return "failed"


@smachpy.state(["done"])
def dock(userdata):
    return "done"


def machine() -> StateMachine:
    sm = StateMachine(["done", "aborted"], name="M")
    sm.add("WORK", work, {"failed": [when("level < 0.3", "aborted"), "MORE"]})
    sm.add("MORE", dock)
    sm.add_cleanup("DOCK", dock)
    return sm


def test_the_picture_says_what_runs_at_any_end_and_what_each_case_asks():
    node = extract(smachpy.describe(machine()))
    assert [child.note for child in node.children] == ["", "", "at any end"]
    notes = {(edge.source, edge.target): edge.note for edge in node.edges}
    assert notes["WORK", "aborted"] == "[level < 0.3]"
    assert notes["WORK", "MORE"] == ""


def test_why_names_the_state_that_decided_and_its_condition_not_the_clean_up():
    sm, story = machine(), []
    sm.subscribe(lambda event: story.append(to_record(event)))
    assert sm.execute() == "aborted"
    last = why(smachpy.describe(sm), story).steps
    assert [step.path for step in last] == ["/M/WORK", "/M"]
    assert last[0].reason == "leads to aborted, as level < 0.3"


def test_why_says_that_a_run_without_an_end_tidies_up():
    sm, story = machine(), []
    sm.subscribe(lambda event: story.append(to_record(event)))
    sm.execute()
    begun = next(i for i, event in enumerate(story) if event["path"] == "/M/DOCK")
    found = why(smachpy.describe(sm), story[: begun + 1])
    assert "to tidy up" in found.text()


def test_terminal_and_list_say_that_a_run_tidies_up():
    sm, story = machine(), []
    sm.subscribe(lambda event: story.append(to_record(event)))
    sm.execute()
    record = smachpy.describe(sm)
    view = TerminalView(record, plain=True, clock=VirtualClock())
    assert ", tidying up" in view._active("/M/DOCK", 1.0).plain
    assert "tidying up" not in view._active("/M/WORK", 1.0).plain
    begun = next(i for i, event in enumerate(story) if event["path"] == "/M/DOCK")
    row = RowFold(record)
    for event in story[: begun + 1]:
        row.add(event)
    assert row.row(lambda: "")["reason"] == "DOCK, tidying up"
    left = next(event for event in story[begun:] if event["kind"] == "Left")
    line = EventLines(record, view.history, panel=False).line(from_record(left))
    assert "DOCK  tidied up: done" in line.plain
