"""Runs during which the computer's clock is set: durations and orders are those that passed."""

from __future__ import annotations

import io
import json
import logging

import pytest

from actionlib_core.clock import VirtualClock, use_clock
from smachpy import CBState, StateMachine
from smachpy.command.event_stream import EventStream
from smachpy.events.introspection import describe
from smachpy.events.recording import Recorder, joined, read_recording
from smachpy.events.run_state import RunState
from smachpy.events.steady import TOLERANCE_NS, SteadyStamps
from smachpy.states import Wait
from tests.wall_clock import Computer

S = 10**9
YEARS_NS = 50 * 365 * 86_400 * S


def fixed(*records):
    """Return the steady stamps [s] of records: (kind, t [s], stamp [s])."""
    steady = SteadyStamps()
    made = [
        {"kind": kind, "path": "/M" if kind == "Started" else "/M/A", "t": t, "stamp_ns": s * S}
        for kind, t, s in records
    ]
    return [steady.fix(record)["stamp_ns"] / S for record in made]


@pytest.mark.parametrize("step", [-3600, 3600, YEARS_NS // S])
def test_stamps_after_a_step_go_on_from_those_before(step):
    assert fixed(("Started", 5.0, 1000), ("Entered", 6.0, 1001), ("Left", 7.0, 1002 + step)) == [
        1000,
        1001,
        1002,
    ]


def test_stamps_that_agree_stay_and_others_are_kept_beside():
    steady = SteadyStamps()
    record = {"kind": "Started", "path": "/M", "t": 5.0, "stamp_ns": 1000}
    assert steady.fix(dict(record)) == record
    near = {"kind": "Left", "path": "/M/A", "t": 6.0, "stamp_ns": 1000 + S + TOLERANCE_NS}
    assert steady.fix(dict(near)) == near
    far = {**near, "stamp_ns": near["stamp_ns"] + 1}
    assert steady.fix(dict(far)) == {**far, "stamp_ns": 1000 + S, "wall_ns": far["stamp_ns"]}
    assert steady.at(7.0) == 1000 + 2 * S


def test_next_run_has_the_new_date_but_never_one_before_the_last():
    assert fixed(("Started", 5.0, 1000), ("Left", 6.0, 8001), ("Started", 9.0, 8004)) == [
        *(1000, 1001),
        8004,
    ]
    assert fixed(("Started", 5.0, 1000), ("Left", 6.0, 1001), ("Started", 9.0, 10)) == [
        *(1000, 1001),
        1001,
    ]


@pytest.mark.parametrize("kind", ["Recovered", "Entered"])
def test_process_that_goes_on_begins_with_its_own_stamps_unless_they_are_earlier(kind):
    before = ("Started", 500.0, 1000), ("Entered", 501.0, 1001)
    assert fixed(*before, (kind, 2.0, 2000), ("Left", 3.0, 9999))[2:] == [2000, 2001]
    assert fixed(*before, (kind, 2.0, 500), ("Left", 3.0, 501))[2:] == [1001, 1002]


def test_records_without_a_monotonic_time_stay_as_they_are():
    steady = SteadyStamps()
    assert steady.at(5.0) == 0
    record = {"kind": "Observed", "path": "", "stamp_ns": 7}
    assert steady.fix(dict(record)) == record


# -- whole runs --------------------------------------------------------------------------------


@pytest.fixture
def computer():
    clock = VirtualClock()
    computer = Computer(clock)
    with clock, use_clock(computer):
        yield computer


def machine_of(computer, step):
    """Return a machine of 3 s in whose middle the clock is set."""

    def set_clock(_userdata):
        computer.ahead += step
        return "done"

    machine = StateMachine(["done", "preempted"], name="M")
    machine.add("A", Wait(1.0), {"done": "STEP"})
    machine.add("STEP", CBState(set_clock, outcomes=["done"]), {"done": "B"})
    machine.add("B", Wait(2.0))
    return machine


def spans(records):
    """Return what people read of a run: the seconds of each state, and of the run."""
    state = RunState()
    for record in records:
        state.fold(record)
    seconds = {path: round(s["seconds"], 3) for path, s in state.data["states"].items()}
    return seconds, round((state.data["ended"] - state.data["started"]) / S, 3)


EXPECTED = {"/M": 3.0, "/M/A": 1.0, "/M/STEP": 0.0, "/M/B": 2.0}


@pytest.mark.parametrize("step", [-3600.0, 3600.0, YEARS_NS / S])
def test_durations_of_a_recorded_run_are_those_that_passed(computer, tmp_path, step, caplog):
    """They were -3,599 s, or 47 years."""
    machine = machine_of(computer, step)
    buffer, stream = machine.event_buffer(), io.StringIO()
    with EventStream(stream, describe(machine), computer.time_ns()) as lines:
        machine.subscribe(lines.on_event)
        with Recorder(tmp_path / "run.jsonl", machine):
            assert machine.execute() == "done"
    records = buffer.read()
    streamed = [json.loads(line) for line in stream.getvalue().splitlines()[1:]]
    recorded = read_recording(tmp_path / "run.jsonl").events
    for events in (records, streamed, recorded):
        assert spans(events) == (EXPECTED, 3.0)
        stamps = [event["stamp_ns"] for event in events]
        assert stamps == sorted(stamps)
    assert buffer.now_ns() == pytest.approx(records[-1]["stamp_ns"], abs=S)
    warned = [record for record in caplog.records if "computer's clock was" in record.getMessage()]
    assert [record.levelno for record in warned] == [logging.WARNING]


def test_the_name_of_a_machine_may_have_a_slash(computer, tmp_path):
    """The end of its recording said no outcome, and its next run had the old date."""
    machine = StateMachine(["done"], name="r1/patrol")
    machine.add("A", CBState(lambda _: "done", outcomes=["done"]))
    with Recorder(tmp_path / "run.jsonl", machine):
        machine.execute()
        computer.ahead = 3600.0
        machine.execute()
    end = json.loads((tmp_path / "run.jsonl").read_text().splitlines()[-1])
    assert (end["kind"], end["path"], end["outcome"]) == ("End", "/r1/patrol", "done")
    assert end["stamp_ns"] - end["first_ns"] == pytest.approx(3600 * S, abs=S)


def test_recording_made_by_an_older_version_is_read_with_the_durations_that_passed(
    computer, tmp_path
):
    with Recorder(tmp_path / "run.jsonl", machine := machine_of(computer, -3600.0)):
        machine.execute()
    lines = (tmp_path / "run.jsonl").read_text().splitlines()
    old = [lines[0]]
    for line in map(json.loads, lines[1:]):
        line["stamp_ns"] = line.pop("wall_ns", line["stamp_ns"])  # as they were written
        old.append(json.dumps(line))
    (tmp_path / "old.jsonl").write_text("\n".join(old) + "\n")
    assert "wall_ns" not in "".join(old)
    assert spans(read_recording(tmp_path / "old.jsonl").events) == (EXPECTED, 3.0)


def test_parts_of_a_run_are_joined_in_their_order_whatever_the_clocks_say(computer, tmp_path):
    """The computer that resumed the mission had a clock that is an hour behind."""
    for name in ("one", "two"):
        with Recorder(tmp_path / f"{name}.jsonl", machine := machine_of(computer, 0.0)):
            machine.execute()
        computer.ahead = -3600.0
    parts = [read_recording(tmp_path / f"{name}.jsonl") for name in ("one", "two")]
    begun = parts[0].stamp_ns
    recovered = {
        **parts[1].events[0],
        "kind": "Recovered",
        "began_ns": begun,
        "outages": [[begun, begun + S]],
        "active": [],
    }
    parts[1].events[0] = recovered
    assert parts[1].stamp_ns < parts[0].stamp_ns
    events = joined(parts[::-1]).events
    assert [event["kind"] for event in events].index("Recovered") == len(parts[0].events)
    stamps = [event["stamp_ns"] for event in events]
    assert stamps == sorted(stamps)
