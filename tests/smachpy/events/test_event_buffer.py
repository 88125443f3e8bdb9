"""Event buffers: what they take down is what a listener hears, whatever happens, and costs no more."""

from __future__ import annotations

import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import smachpy
from actionlib_core.clock import RealClock, VirtualClock, use_clock
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.events import (
    Entered,
    Fired,
    HeldBack,
    Left,
    Recovered,
    Started,
    UserdataWritten,
    to_record,
)
from smachpy.events import buffer as buffers
from smachpy.events.buffer import RawEventBuffer
from smachpy.events.run_state import RunState


class Work(State):
    def __init__(self, seconds=1.0, outcome="ok"):
        super().__init__([outcome, "preempted"], output_keys=["who"])
        self.seconds = seconds
        self.outcome = outcome

    def execute(self, userdata):
        userdata.who = self.outcome
        if self.sleep(self.seconds):
            self.service_preempt()
            return "preempted"
        return self.outcome


class Quick(State):
    def __init__(self, *outcomes):
        super().__init__(outcomes or ["ok"])

    def execute(self, userdata):
        return self.get_registered_outcomes()[0]


def mission():
    inner = StateMachine(["done", "preempted"])
    with inner:
        StateMachine.add("A", Work(1.0), {"ok": "B"})
        StateMachine.add("B", Quick(), {"ok": "C"})
        StateMachine.add("C", Quick(), {"ok": "done"})
    loop = Iterator(["done", "preempted"], [], [], it=range(3), exhausted_outcome="done")
    with loop:
        Iterator.set_contained_state("EACH", Work(0.5), loop_outcomes=["ok"])
    both = Concurrence(["done", "preempted"], "done")
    with both:
        Concurrence.add("INNER", inner)
        Concurrence.add("LOOP", loop)
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        StateMachine.add("FIRST", Work(1.0), {"ok": "Q1", "preempted": "STOP"})
        StateMachine.add("Q1", Quick(), {"ok": "BOTH"})
        StateMachine.add("BOTH", both, {"done": "LAST"})
        StateMachine.add("LAST", Work(1.0), {"ok": "done"})
        StateMachine.add("STOP", Quick(), {"ok": "done"})
    return sm


def without_seq(records):
    return [{key: value for key, value in one.items() if key != "seq"} for one in records]


def story(way, act, *, seed=None, make=mission):
    """Run a machine while `act(clock, machine)` happens; return what was heard or taken down."""
    with VirtualClock(seed) as clock, use_clock(clock):
        sm = make()
        heard = []
        if way == "listener":
            sm.subscribe(lambda event: heard.append(json.loads(json.dumps(to_record(event)))))
        else:
            buffer = sm.event_buffer() if way == "buffer" else RawEventBuffer(sm)
        act(clock, sm)
        sm.execute()
        if way == "buffer":
            heard = without_seq(buffer.read())
        elif way == "events":
            heard = [to_record(event) for event in buffer.events()]
        return json.loads(json.dumps(heard))


def both_ways(act, **how):
    taken, heard = story("buffer", act, **how), story("listener", act, **how)
    assert taken == heard
    assert story("events", act, **how) == heard
    return taken


def test_a_whole_run():
    records = both_ways(lambda clock, sm: None)
    assert [r["kind"] for r in records[:3]] == ["Started", "Entered", "UserdataWritten"]
    assert records[-1]["kind"] == "Finished"


@pytest.mark.parametrize("seed", [None, 1, 2, 3])
@pytest.mark.parametrize("at", [i * 0.25 for i in range(17)])
def test_a_preempt_at_any_instant(at, seed):
    both_ways(lambda clock, sm: clock.call_later(at, sm.request_preempt), seed=seed)


@pytest.mark.parametrize("at", [0.25, 1.25, 2.25])
def test_an_operator_at_any_instant(at):
    def act(clock, sm):
        clock.call_later(at, sm.control.pause)
        clock.call_later(at + 3.0, sm.control.step)
        clock.call_later(at + 6.0, sm.control.resume)

    records = both_ways(act)
    assert "Paused" in {record["kind"] for record in records}


@pytest.mark.parametrize("what", ["raises", "unknown", "preempt in callback", "breakpoint"])
def test_trouble(what):
    def make():
        class Bad(Quick):
            def execute(self, userdata):
                if what == "raises":
                    raise ValueError("motor")
                if what == "preempt in callback":
                    sm.request_preempt()
                return "nowhere" if what == "unknown" else "ok"

        sm = StateMachine(["ok", "preempted"], name="M")
        with sm:
            StateMachine.add("A", Quick(), {"ok": "B"})
            StateMachine.add("B", Bad(), {"ok": "C"})
            StateMachine.add("C", Quick())
        return sm

    def act(clock, sm):
        if what == "breakpoint":
            sm.control.add_breakpoint("/M/B", "ok")
            clock.call_later(1.0, sm.control.resume)
        inner = sm.execute

        def execute():
            try:
                return inner()
            except smachpy.SmachError:
                return None

        sm.execute = execute

    records = both_ways(act, make=make)
    kinds = [record["kind"] for record in records]
    assert kinds[-1] == "Finished"
    assert ("Failed" in kinds) == (what == "raises")


ACTS = st.lists(
    st.tuples(
        st.sampled_from(
            ["preempt", "pause", "step", "resume", "jump", "force", "listen", "forget"]
        ),
        st.integers(0, 16).map(lambda n: n * 0.25),
    ),
    max_size=6,
)


@settings(max_examples=60)
@given(ACTS, st.integers(0, 1000))
def test_whatever_happens_a_second_buffer_and_a_listener_agree(acts, seed):
    """Listeners that come and go change the way that events are taken down, not the events."""
    with VirtualClock(seed) as clock, use_clock(clock):
        sm = mission()
        buffer = sm.event_buffer()
        forget = []

        def do(what):
            try:
                if what == "preempt":
                    sm.request_preempt()
                elif what == "jump":
                    sm.control.jump("/M/LAST")
                elif what == "force":
                    sm.control.force_outcome("/M/FIRST", "ok")
                elif what == "listen":
                    forget.append(sm.subscribe(lambda event: None))
                elif what == "forget":
                    forget.pop()() if forget else None
                else:
                    getattr(sm.control, what)()
            except smachpy.SmachError:
                return

        for what, at in acts:
            clock.call_later(at, lambda what=what: do(what))
        clock.call_later(30.0, sm.control.resume)
        outcome = sm.execute()
        records = buffer.read()
    assert [record["seq"] for record in records] == list(range(1, len(records) + 1))
    assert records[-1]["outcome"] == outcome
    active = []
    for record in records:
        if record["kind"] in ("Entered", "Started"):
            active.append(record["path"])
        elif record["kind"] in ("Left", "Finished"):
            active.remove(record["path"])
    assert active == []
    times = [record["t"] for record in records]
    assert times == sorted(times)


def ring(rounds, outcome="ok"):
    class Last(State):
        def __init__(self):
            super().__init__(["again", "ok"])
            self.left = rounds

        def execute(self, userdata):
            self.left -= 1
            return "again" if self.left else outcome

    sm = StateMachine(["ok"], name="R")
    with sm:
        StateMachine.add("A", Quick(), {"ok": "B"})
        StateMachine.add("B", Last(), {"again": "A"})
    return sm


def what_goes_on(records):
    """What viewers must not get wrong, though they miss events."""
    state = RunState()
    for record in records:
        state.fold(record)
    facts = ("since", "preempt", "serviced", "waits", "item")
    states = state.data["states"]
    return {
        **{name: state.data[name] for name in ("ended", "outcome", "userdata")},
        "goals": {i: goal for i, goal in state.data["goals"].items() if goal["ended"] is None},
        "states": {
            path: [one["since"] is None and one["outcome"], *map(one.get, facts)]
            for path, one in states.items()
        },
    }


def assert_thinned(records, whole):
    """The records are some of the whole, under their numbers, and tell what goes on in the end."""
    by_number = {record["seq"]: record for record in whole}
    before = 0
    for record in records:
        assert record["seq"] == before + 1 + record.get("dropped", 0)
        assert {k: v for k, v in record.items() if k != "dropped"} == by_number[record["seq"]]
        before = record["seq"]
    assert before == len(whole)
    assert what_goes_on(records) == what_goes_on(whole)


def test_who_does_not_read_sees_how_it_ended_and_what_is_missing(clock, monkeypatch):
    monkeypatch.setattr(buffers, "SLACK", 50)
    sm = ring(1000)
    whole, buffer = sm.event_buffer(), sm.event_buffer(limit=100)
    sm.execute()
    found = buffer.read()
    assert len(found) < 350
    assert [r["seq"] for r in found[:99]] == list(range(1, 100))  # and a note
    assert found[-1]["kind"] == "Finished"
    assert buffer.dropped == sum(record.get("dropped", 0) for record in found)
    assert buffer.dropped + len(found) == 2 + 4 * 1000
    assert_thinned(found, whole.read())
    sm["B"].left = 1
    sm.execute()
    assert [r["seq"] for r in buffer.read()] == [4003 + i for i in range(6)]


def test_a_question_that_waits_is_not_lost_in_a_flood():
    """What a full buffer keeps is what tells what goes on now."""
    asked = {"kind": "QuestionAsked", "path": "/ROOT/ASK"}
    entries = [{"kind": "Entered", "path": "/ROOT/ASK"}, asked]
    for _ in range(50):
        for kind in ("Entered", "Left"):
            entries.append({"kind": kind, "path": "/ROOT/BUSY"})
    kept, _ = buffers.thin(entries)
    assert asked in kept
    entries.insert(2, {"kind": "Left", "path": "/ROOT/ASK"})
    kept, _ = buffers.thin(entries)
    assert asked not in kept


def test_the_marking_of_a_plan_is_not_lost_in_a_flood():
    """Viewers showed a plan whose tokens were where they had been before the flood."""
    entries = [Entered("/P", 0.0, 0)]
    for number in range(50):
        entries.append(Fired("/P", 0.0, 0, f"t{number}", (f"p{number}",)))
        entries.append(HeldBack("/P", 0.0, 0, (f"t{number + 1}",), ("there",)))
        entries += [Entered("/P/BUSY", 0.0, 0), Left("/P/BUSY", 0.0, 0, "done")]
    state = RunState()
    for kept in buffers.thin(entries)[0]:
        if not isinstance(kept, buffers._Dropped):
            state.fold(to_record(kept))
    plan = state.data["states"]["/P"]
    assert (plan["marking"], plan["fired"]) == (["p49"], "t49")
    assert plan["held"] == {"t50": "there is false"}


def test_a_flood_of_visits_keeps_whole_visits(monkeypatch):
    """No visit gets the end of another one: a duration that is told has been measured."""
    monkeypatch.setattr(buffers, "SLACK", 4)

    class Slow(State):
        def __init__(self):
            super().__init__(["again", "ok"])
            self.left = 50

        def execute(self, userdata):
            self.left -= 1
            self.sleep(1.0)
            return "again" if self.left else "ok"

    with VirtualClock() as clock, use_clock(clock):
        sm = StateMachine(["ok"], name="M")
        with sm:
            StateMachine.add("S", Slow(), {"again": "S"})
        buffer = sm.event_buffer(limit=3)
        sm.execute()
        records = buffer.read()
    times = {}
    for record in records:
        if record["kind"] in ("Entered", "Started"):
            times[record["path"]] = record["t"]
        elif record["path"] == "/M/S":
            assert record["t"] - times.pop("/M/S") == 1.0
    assert [record["kind"] for record in records][-2:] == ["Left", "Finished"]


@settings(max_examples=60)
@given(ACTS, st.integers(0, 1000), st.integers(0, 8), st.integers(1, 8))
def test_whatever_happens_what_is_kept_tells_what_goes_on(acts, seed, limit, slack):
    with VirtualClock(seed) as clock, use_clock(clock), pytest.MonkeyPatch.context() as patch:
        patch.setattr(buffers, "SLACK", slack)
        sm = mission()
        whole, buffer = sm.event_buffer(), sm.event_buffer(limit=limit)
        told, all_of_it = [], []

        def do(what):
            try:
                if what == "preempt":
                    sm.request_preempt()
                elif what == "jump":
                    sm.control.jump("/M/LAST")
                elif what == "force":
                    sm.control.force_outcome("/M/FIRST", "ok")
                elif what in ("listen", "forget"):
                    told.extend(buffer.read())
                    all_of_it.extend(whole.read())
                    assert_thinned(told, all_of_it)
                else:
                    getattr(sm.control, what)()
            except smachpy.SmachError:
                return

        for what, at in acts:
            clock.call_later(at, lambda what=what: do(what))
        clock.call_later(30.0, sm.control.resume)
        sm.execute()
        assert_thinned(told + buffer.read(), all_of_it + whole.read())


def test_news_are_told_once_until_everything_is_read(clock):
    told = []
    sm = ring(3)
    buffer = sm.event_buffer(lambda: told.append(len(told)))
    sm.execute()
    assert told == [0]
    assert buffer.read()
    assert buffer.read() == []
    sm["B"].left = 1
    sm.execute()
    assert told == [0, 1]


def test_news_are_told_also_after_what_a_resumed_run_had_told_before(clock):
    """The viewers of a mission that was resumed heard nothing more."""
    told = []
    buffer = StateMachine(["ok"], name="M").event_buffer(lambda: told.append(len(told)))
    buffer.begin("/M", clock)
    buffer.take(Recovered("/M", 0.0, 1, "", 1, (), (("/M", 1), ("/M/A", 1))))
    assert [record["kind"] for record in buffer.read()] == ["Recovered"]
    assert buffer.read() == []
    buffer.take(Entered("/M/A", 1.0, 2))
    assert told == [0, 1]
    assert buffer.read() == []
    buffer.take(Left("/M/A", 2.0, 3, "ok"))
    assert told == [0, 1, 2]
    assert [record["kind"] for record in buffer.read()] == ["Left"]


def test_a_reader_that_cannot_be_told_hurts_nobody(clock, caplog):
    sm = ring(1)
    buffer = sm.event_buffer(lambda: 1 / 0)
    assert sm.execute() == "ok"
    assert len(buffer.read()) == 6
    assert "on_news" in caplog.text


def test_a_closed_buffer_takes_nothing_down(clock):
    sm = ring(1)
    buffer = sm.event_buffer()
    buffer.close()
    buffer.close()
    sm.execute()
    assert buffer.read() == []


def test_a_buffer_of_a_part_and_under_another_name(clock):
    sm = mission()
    part = sm["BOTH"]["INNER"].event_buffer(name="/SHOWN")
    whole = sm.event_buffer(name="/ROBOT/M")
    sm.execute()
    paths = {record["path"] for record in part.read()}
    assert paths == {"/SHOWN/A", "/SHOWN/B", "/SHOWN/C"}
    assert "/ROBOT/M/BOTH/INNER/A" in {record["path"] for record in whole.read()}


def test_a_value_is_taken_down_as_it_was_then(clock):
    class Writes(State):
        def __init__(self):
            super().__init__(["ok"], output_keys=["found"])

        def execute(self, userdata):
            found = [1]
            userdata.found = found
            found.append(2)
            return "ok"

    sm = StateMachine(["ok"])
    sm.add("A", Writes())
    buffer = sm.event_buffer()
    sm.execute()
    (written,) = [r for r in buffer.read() if r["kind"] == "UserdataWritten"]
    assert written["value"] == [1]


def test_times_are_those_of_the_computer():
    with use_clock(RealClock()) as clock:
        sm = mission_of_quick_states()
        buffer = sm.event_buffer()
        before = clock.now(), clock.time_ns()
        sm.execute()
        records = buffer.read()
        after = clock.now(), clock.time_ns()
    assert [r["t"] for r in records] == sorted(r["t"] for r in records)
    stamps = [r["stamp_ns"] for r in records]
    assert stamps == sorted(stamps)
    assert before[0] <= records[0]["t"] <= records[-1]["t"] <= after[0]
    assert before[1] - 1_000_000 <= stamps[0] <= stamps[-1] <= after[1] + 1_000_000


def mission_of_quick_states():
    sm = StateMachine(["ok"], name="M")
    with sm:
        StateMachine.add("A", Quick(), {"ok": "B"})
        StateMachine.add("B", Quick(), {"ok": "C"})
        StateMachine.add("C", Quick())
    return sm


def test_two_buffer_hear_the_same(clock):
    sm = mission()
    one, two = sm.event_buffer(), sm.event_buffer()
    sm.execute()
    assert one.read() == two.read()


def test_a_buffer_of_events_gives_what_a_listener_gets():
    with VirtualClock() as clock, use_clock(clock):
        sm, heard = mission(), []
        buffer = RawEventBuffer(sm)
        clock.call_later(0.5, lambda: sm.subscribe(heard.append))  # the buffer was alone till then
        sm.execute()
        events = buffer.events()
    assert [type(event) for event in events[:3]] == [Started, Entered, UserdataWritten]
    assert events[-len(heard) :] == heard
    assert {type(event) for event in heard} >= {Entered, Left, UserdataWritten}
    assert buffer.events() == []
    buffer.close()


@pytest.mark.slow
def test_a_buffer_of_events_keeps_all_of_them_with_the_values_themselves():
    value = object()

    class Writes(State):
        def __init__(self):
            super().__init__(["ok"], output_keys=["what"])

        def execute(self, userdata):
            userdata.what = value
            return "ok"

    with use_clock(RealClock()):
        sm = ring(60_000)  # more transitions than a buffer of records keeps
        buffer = RawEventBuffer(sm)
        sm.execute()
        assert len(buffer.events()) == 240_000 + 2
        assert buffer.dropped == 0
        sm = StateMachine(["ok"])
        with sm:
            StateMachine.add("W", Writes())
        buffer = RawEventBuffer(sm)
        sm.execute()
    (written,) = [event for event in buffer.events() if isinstance(event, UserdataWritten)]
    assert written.value is value


@pytest.mark.parametrize(("waiting", "has_room"), [(0, True), (2, True), (3, False), (4, False)])
def test_a_buffer_has_room_while_half_of_its_limit_is_free(waiting, has_room):
    buffer = smachpy.StateMachine(["done"]).event_buffer(limit=4)
    for number in range(waiting):
        buffer.take(Entered(f"/M/S{number}", 0.0, 0))
    assert buffer.has_room() is has_room
    buffer.read()
    assert buffer.has_room()
