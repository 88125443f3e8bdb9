"""Why a run ended so: real runs in virtual time, and events that are cut, missing or strange."""

from __future__ import annotations

import contextlib
import itertools
import json
import random

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, current_clock, use_clock
from smachpy import CBState, Concurrence, Iterator, State, StateMachine
from smachpy.command import main
from smachpy.events import to_record
from smachpy.events.introspection import describe
from smachpy.events.recording import Recorder
from smachpy_viz.model.why import why


class Waits(State):
    def __init__(self, seconds, outcome="ok"):
        super().__init__(outcomes=["ok", "low", "aborted", "preempted"], output_keys=["left"])
        self.seconds = seconds
        self.outcome = outcome

    def execute(self, userdata):
        userdata.left = 3
        return "preempted" if self.sleep(self.seconds) else self.outcome


class Breaks(State):
    def __init__(self):
        super().__init__(outcomes=["ok"])

    def execute(self, userdata):
        return self.helper()

    def helper(self):
        return {}["no such key"]


def ran(machine):
    """The record and the events of one run."""
    events = []
    with use_clock(VirtualClock()):
        cancel = machine.subscribe(lambda event: events.append(to_record(event)))
        with contextlib.suppress(smachpy.InvalidUserCodeError):
            machine.execute()
        cancel()
    return describe(machine), events


def steps(found):
    return [(step.path, step.what) for step in found.steps]


def machine(
    children, outcomes=("ok", "low", "aborted", "preempted", "done"), name="TOP", **options
):
    sm = StateMachine(outcomes=list(outcomes), name=name, **options)
    with sm:
        for label, state, transitions in children:
            StateMachine.add(label, state, transitions)
    return sm


def test_an_exception_is_followed_from_its_line_to_the_outcome():
    inner = machine([("BOOM", Breaks(), {"ok": "ok"})])
    found = why(*ran(machine([("INNER", inner, {})])))
    assert found.outcome == "exception"
    assert steps(found) == [
        ("/TOP/INNER/BOOM", "raised KeyError: 'no such key'"),
        ("/TOP/INNER/BOOM", "exception"),
        ("/TOP/INNER", "exception"),
        ("/TOP", "exception"),
    ]
    lines = found.steps[0].detail.splitlines()
    assert len(lines) == 2
    assert lines[-1].endswith('in helper: return {}["no such key"]')
    assert "test_why.py:" in lines[-1]


def test_the_child_that_stopped_the_others_of_a_concurrence_is_the_cause():
    both = Concurrence(
        outcomes=["low", "aborted"],
        default_outcome="aborted",
        outcome_map={"low": {"WATCH": "low", "WORK": "preempted"}},
        child_termination_cb=lambda _: True,
    )
    with both:
        Concurrence.add("WORK", Waits(50.0))
        Concurrence.add("WATCH", Waits(2.0, "low"))
    found = why(*ran(machine([("BOTH", both, {"low": "aborted"})])))
    assert found.outcome == "aborted"
    assert steps(found) == [("/TOP/BOTH/WATCH", "low"), ("/TOP/BOTH", "low"), ("/TOP", "aborted")]
    watch, container, _ = found.steps
    assert "rule for low" in watch.reason
    assert container.reason == "leads to aborted"
    assert watch.written == (("left", "3", "3"),)
    assert watch.stamp_ns - found.began == 2_000_000_000


def test_an_outcome_that_a_callback_chose_is_not_called_the_default():
    def told(cb):
        both = Concurrence(outcomes=["low", "aborted"], default_outcome="aborted", outcome_cb=cb)
        with both:
            Concurrence.add("WATCH", Waits(2.0, "ok"))
        return why(*ran(machine([("BOTH", both, {})]))).steps[0].reason

    assert told(lambda _: "low") == "no rule of BOTH names it"
    assert told(lambda _: None) == "no rule of BOTH names it; its default is aborted"


def test_failures_that_were_handled_in_vain_come_first():
    sm = machine(
        [
            ("FINE", Waits(1.0), {"ok": "DRIVE"}),
            ("DRIVE", Waits(1.0, "aborted"), {"aborted": "RETREAT"}),
            ("RETREAT", Waits(1.0, "aborted"), {}),
        ]
    )
    found = why(*ran(sm))
    assert steps(found) == [
        ("/TOP/DRIVE", "aborted"),
        ("/TOP/RETREAT", "aborted"),
        ("/TOP", "aborted"),
    ]
    assert found.steps[0].reason == "leads to RETREAT"
    assert "no transition for it" in found.steps[1].reason


def test_a_timeout_and_who_asked_are_first_causes():
    sm = StateMachine(outcomes=["ok", "low", "aborted", "preempted", "late"], name="TOP")
    with sm:
        slow = Waits(50.0)
        smachpy.set_options(slow, timeout=1.5, timeout_outcome="late")
        StateMachine.add("SLOW", slow, {"late": "late"})
    found = why(*ran(sm))
    assert found.steps[0].what == "ran into its timeout of 1.5 s"
    assert found.steps[-1].what == "late"

    asked = {"kind": "PreemptRequested", "path": "/TOP", "source": "operator", "by": "Ann"}
    told = numbered([started(), asked, finished("preempted")])
    found = why(describe(sm), told)
    assert found.steps[0].what == "asked to stop by operator Ann"
    assert found.steps[-1].kind == "preempted"


def test_a_goal_that_is_lost_is_the_first_cause():
    sm = machine([("DRIVE", Waits(1.0, "aborted"), {})])
    done = {"kind": "GoalDone", "path": "/TOP/DRIVE", "goal_id": "1", "action": "move_base"}
    told = numbered(
        [
            started(),
            {"kind": "Entered", "path": "/TOP/DRIVE"},
            {"kind": "Retried", "path": "/TOP/DRIVE", "attempt": 1, "reason": "aborted"},
            {**done, "status": "LOST", "text": "the server is gone", "result": None},
            {"kind": "Left", "path": "/TOP/DRIVE", "outcome": "aborted"},
            finished("aborted"),
        ]
    )
    found = why(describe(sm), told)
    assert found.steps[0].what == "goal to move_base: LOST"
    assert found.steps[0].reason == "the server is gone, in attempt 2"
    assert [step.what for step in found.steps[1:]] == ["aborted", "aborted"]


def started():
    return {"kind": "Started", "path": "/TOP", "initial": []}


def finished(outcome):
    return {"kind": "Finished", "path": "/TOP", "outcome": outcome}


def numbered(events):
    return [{"stamp_ns": n * 10**9, "t": n, "seq": n, **one} for n, one in enumerate(events, 1)]


def test_every_cut_of_a_run_has_an_answer():
    record, events = ran(machine([("A", machine([("B", Waits(1.0, "aborted"), {})]), {})]))
    for cut in range(len(events) + 1):
        for rest in (events[:cut], events[cut:]):
            found = why(record, rest)
            assert found.text()
            assert json.dumps(found.to_json())
    assert why(record, []).began is None
    assert "has not run" in why(record, []).text()
    running = why(record, events[:-3])
    assert running.outcome is None
    assert running.steps[-1].what == "entered, and not left"


def test_only_the_newest_run_counts():
    record, events = ran(machine([("A", Waits(1.0), {"ok": "done"})]))
    old = numbered([started(), finished("aborted")])
    found = why(record, [*old, *events])
    assert found.outcome == "done"
    assert [step.what for step in found.steps] == ["ok", "done"]


def test_control_characters_of_names_and_values_stay_out():
    sm = machine([("A", Waits(1.0), {"ok": "done"})])
    wrote = {"kind": "UserdataWritten", "path": "/TOP/A", "key": "\x1b]0;k", "value": "\x1b[31m"}
    left = {"kind": "Left", "path": "/TOP/A", "outcome": "ok\x1b[2J"}
    told = numbered(
        [started(), {"kind": "Entered", "path": "/TOP/A"}, wrote, left, finished("x\x1b")]
    )
    assert "\x1b" not in why(describe(sm), told).text()


def test_the_command(tmp_path, capsys):
    sm = machine([("A", machine([("BOOM", Breaks(), {"ok": "ok"})]), {})])
    path = tmp_path / "run.jsonl"
    with Recorder(path, sm), pytest.raises(smachpy.InvalidUserCodeError):
        sm.execute()
    assert main(["runs", "why", str(path)]) == 0
    said = capsys.readouterr().out
    assert "because:" in said
    assert "raised KeyError" in said
    assert main(["runs", "why", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["outcome"] == "exception"
    assert told["text"] in said.rstrip("\n")
    assert main(["runs", "why", str(tmp_path / "none.jsonl")]) == 2
    (tmp_path / "bad.jsonl").write_text("no run")
    assert main(["runs", "why", str(tmp_path / "bad.jsonl")]) == 2


def test_a_function_that_is_no_state_tells_its_line_too():
    sm = machine([("A", CBState(lambda _: 1 / 0, outcomes=["ok"]), {"ok": "done"})])
    found = why(*ran(sm))
    assert "ZeroDivisionError" in found.steps[0].what
    assert "1 / 0" in found.steps[0].detail


def test_what_was_written_on_the_way_says_what_it_was_before():
    events = [
        {"kind": "Started", "path": "/TOP", "stamp_ns": 1, "initial": ["A"]},
        {"kind": "UserdataWritten", "path": "/TOP/B", "stamp_ns": 2, "key": "x", "value": 1},
        {"kind": "UserdataWritten", "path": "/TOP/B", "stamp_ns": 2, "key": "other", "value": 1},
        {"kind": "Entered", "path": "/TOP/A", "stamp_ns": 3},
        {"kind": "UserdataWritten", "path": "/TOP/A", "stamp_ns": 4, "key": "x", "value": 2},
        {"kind": "UserdataWritten", "path": "/TOP/A", "stamp_ns": 4, "key": "new", "value": None},
        {"kind": "Left", "path": "/TOP/A", "stamp_ns": 5, "outcome": "aborted"},
        {"kind": "Finished", "path": "/TOP", "stamp_ns": 5, "outcome": "aborted"},
    ]
    record = describe(machine([("A", Waits(1.0, "aborted"), {})]))
    found = why(record, events)
    first, last = found.steps
    assert first.written == (("x", "2", "1"), ("new", "None", ""))
    assert (first.outcome, last.outcome) == ("aborted", "aborted")
    assert "wrote x = 2 (was 1)" in found.text()


@pytest.mark.parametrize(
    ("by", "what"), [("ann", "answered no by ann"), ("", "nobody answered: no")]
)
def test_an_answer_of_the_operator_is_a_cause(by, what):
    events = [
        {"kind": "Started", "path": "/TOP", "stamp_ns": 1, "initial": ["A"]},
        {"kind": "Entered", "path": "/TOP/A", "stamp_ns": 3},
        {"kind": "QuestionAnswered", "path": "/TOP/A", "stamp_ns": 4, "answer": "no", "by": by},
        {"kind": "Left", "path": "/TOP/A", "stamp_ns": 5, "outcome": "aborted"},
        {"kind": "Finished", "path": "/TOP", "stamp_ns": 5, "outcome": "aborted"},
    ]
    record = describe(machine([("A", Waits(1.0, "aborted"), {})]))
    assert steps(why(record, events))[0] == ("/TOP/A", what)


@pytest.mark.parametrize(
    ("success", "kind"), [(None, "success"), (["low"], "failure"), (["ok"], "success")]
)
def test_the_last_step_has_the_class_that_the_machine_gives_its_outcome(success, kind):
    made = machine([("A", CBState(lambda _: "ok", outcomes=["ok"]), {})], success=success)
    assert why(*ran(made)).steps[-1].kind == kind


def test_a_failed_state_says_what_it_read_and_who_had_written_it():
    sm = StateMachine(outcomes=["done", "aborted"], name="JOB")
    inner = StateMachine(["done", "failed"], input_keys=["limit"], output_keys=["limit"])
    with inner:
        inner.add(
            "SLOW",
            CBState(write("speed", 0.3), outcomes=["ok"], output_keys=["speed"]),
            {"ok": "GO"},
        )
        inner.add(
            "GO",
            CBState(lambda _: "failed", outcomes=["failed"], input_keys=["v", "limit", "never"]),
            {"failed": "failed"},
            remapping={"v": "speed", "never": "nothing"},
        )
    inner.userdata.nothing = None
    with sm:
        sm.add(
            "SET",
            CBState(write("most", 5), outcomes=["ok"], output_keys=["most"]),
            {"ok": "DRIVE"},
        )
        sm.add("DRIVE", inner, {"failed": "aborted"}, remapping={"limit": "most"})
    story = []
    sm.subscribe(lambda event: story.append(to_record(event)))
    assert sm.execute() == "aborted"
    found = why(describe(sm), story)
    (step,) = (one for one in found.steps if one.path == "/JOB/DRIVE/GO")
    assert [one[:3] for one in step.read] == [
        ("v", "0.3", "/JOB/DRIVE/SLOW"),
        ("limit", "5", "/JOB/SET"),
    ]
    assert "read v = 0.3 (of /JOB/DRIVE/SLOW at 0.0" in found.text()
    assert all(not one.read for one in found.steps if one.path != "/JOB/DRIVE/GO")


def write(key, value):
    def callback(userdata):
        userdata[key] = value
        return "ok"

    return callback


def at_random(picks, depth, worked):
    """A container of some kind, whose children run again and again, write, read, and fail."""
    keys = {"input_keys": ["a", "b"], "output_keys": ["a", "b"]}

    def work(userdata):
        worked()
        userdata[picks.choice("ab")] = picks.random()
        current_clock().sleep(picks.choice([0.1, 1.0]))
        return picks.choices(["ok", "low", "aborted"], weights=[10, 10, 1])[0]

    if not depth:
        return CBState(work, outcomes=["ok", "low", "aborted", "preempted"], **keys)
    made: StateMachine | Concurrence | Iterator
    kind = picks.choice(["machine", "machine", "concurrence", "iterator"])
    number = 14 if kind == "concurrence" and depth == 1 else picks.choice([2, 3])
    children = [at_random(picks, depth - 1, worked) for _ in range(number)]
    if kind == "iterator":
        made = Iterator(OUTCOMES, it=range(picks.choice([3, 30])), exhausted_outcome="ok", **keys)
        with made:
            made.set_contained_state("C0", children[0], loop_outcomes=["ok", "low"])
    elif kind == "concurrence":
        made = Concurrence(
            OUTCOMES,
            default_outcome="low",
            child_termination_cb=picks.choice([None, lambda ended: "aborted" in ended.values()]),
            outcome_map={"ok": {f"C{i}": "ok" for i in range(number)}},
            **keys,
        )
        with made:
            for i, child in enumerate(children):
                made.add(f"C{i}", child, remapping=picks.choice([{}, {"a": "b", "b": "a"}]))
    else:
        made = StateMachine(OUTCOMES, **keys)
        with made:
            for i, child in enumerate(children):
                ways = {"ok": f"C{picks.randrange(number)}", "low": "SOME"}
                ways |= picks.choice([{}, {"aborted": "C0"}])
                made.add(f"C{i}", child, ways)
            ends = CBState(
                lambda _: picks.choices(["more", "ok", "aborted"], weights=[60, 2, 1])[0],
                outcomes=["more", "ok", "aborted"],
            )
            made.add("SOME", ends, {"more": "C0"})
    return made


OUTCOMES = ["ok", "low", "aborted", "preempted"]


@pytest.mark.parametrize("seed", range(10))
def test_a_run_that_is_not_held_as_a_whole_has_the_same_causes(seed):
    picks = random.Random(seed)
    left = iter(range(200))
    top = StateMachine(OUTCOMES, name="TOP", userdata={"a": 0, "b": 0})

    def worked():
        if next(left, None) is None:
            top.request_preempt()

    with top:
        for label in "PQ":
            ways = {"ok": "P", "low": "Q", **picks.choice([{}, {"aborted": "P"}])}
            top.add(label, at_random(picks, 2, worked), ways)
    record, events = ran(top)
    assert len(events) > 50
    for size in {len(events), *picks.choices(range(1, len(events)), k=20)}:
        cut = events[:size]
        assert why(record, iter(cut), held=picks.choice([1, 20])) == why(record, cut)


def failing_again_and_again(times, inner):
    visits = itertools.count(1)
    again = CBState(
        lambda _: "aborted" if next(visits) % times else "ok", outcomes=["ok", "aborted"]
    )
    ways = {"aborted": "FAILS", "ok": "aborted"}
    return machine([("FAILS", inner, {"aborted": "AGAIN"}), ("AGAIN", again, ways)])


def many_at_once():
    both = Concurrence(["ok", "aborted"], default_outcome="aborted")
    with both:
        for number in range(20):
            outcome = "aborted" if number == 0 else "ok"
            both.add(f"C{number}", Waits(1.0 + number, outcome))
    return both


@pytest.mark.parametrize("times", [5, 50])
@pytest.mark.parametrize(
    "inner",
    [
        lambda: Waits(1.0, "aborted"),
        lambda: failing_again_and_again(6, Waits(1.0, "aborted")),
        many_at_once,
    ],
)
def test_a_long_way_to_an_end_is_told_as_far_as_that_of_a_run_that_is_held(times, inner):
    record, events = ran(failing_again_and_again(times, inner()))
    found = why(record, events, held=10**9)
    assert len(found.steps) > 6
    noted = {"kind": "Noted", "path": "/TOP", "stamp_ns": 2**60, "text": "on"}
    for held in [1, *range(len(events) - 4, len(events))]:
        assert why(record, events, held=held) == found
        assert why(record, [*events[:-1], noted], held=held).ended == noted["stamp_ns"]


def test_a_long_run_is_held_in_part():
    class Told(dict):
        alive = most = 0

        def __init__(self, **facts):
            super().__init__(facts)
            Told.alive += 1
            Told.most = max(Told.most, Told.alive)

        def __del__(self):
            Told.alive -= 1

    record, (started, *_) = ran(machine([("A", Waits(1.0), {}), ("B", Waits(1.0), {})]))

    def events():
        yield started
        for stamp in range(10_000):
            place = {"path": "/TOP/A" if stamp % 2 else "/TOP/B", "stamp_ns": stamp}
            yield Told(kind="Entered", **place)
            yield Told(kind="UserdataWritten", key="left", value=stamp, **place)
            yield Told(kind="Noted", text="on", **place)
            yield Told(kind="Left", outcome="ok", **place)

    assert why(record, events(), held=500).outcome is None
    assert Told.most < 1_100
