"""All runs of a mission: what is planted is found, shortened and can be repeated."""

from __future__ import annotations

import gc
import itertools
import subprocess
import sys
import threading
import time
import weakref
from dataclasses import dataclass, field

import numpy as np
import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.std_msgs.msg import Empty
from smachpy import (
    CBState,
    Concurrence,
    InvalidStateError,
    Iterator,
    MonitorState,
    SimpleActionState,
    State,
    StateMachine,
    set_options,
)
from smachpy.testing import TimeLimitError, UnknownStateError, explore, mission_kit, replay
from smachpy.testing.exploring import exploration
from smachpy.testing.exploring.explorer import Explorer


class Leaf(State):
    def __init__(self, *outcomes, **options):
        super().__init__(outcomes or ("done", "preempted"), **options)

    def execute(self, ud):
        raise AssertionError("the explorer has put a double in my place")


class Makes:
    def __init__(self, what):
        self.what = what

    def make(self):
        return sound()


def sound():
    sm = StateMachine(["done", "failed", "preempted"], name="M")
    with sm:
        sm.add("A", Leaf("done", "failed", "preempted"), {"done": "B"})
        sm.add("B", Leaf("done", "again", "preempted"), {"again": "A"})
    return sm


def test_a_sound_machine_is_explored_to_the_end():
    found = explore(sound())
    assert found
    found.assert_ok()
    assert found.exhaustive
    assert found.stopped_by == ""
    assert found.runs > 8
    assert "all there are: no counterexample" in str(found)


def test_a_machine_with_a_slash_in_its_name_is_explored():
    """It raised a KeyError: the first part of the name was taken for a machine around."""
    inner, limited = sound(), StateMachine(["done", "late", "preempted"], name="r1/M")
    set_options(inner, timeout=5.0, timeout_outcome="late")
    limited.add("IN", inner, {"failed": "done"})
    expected = explore(limited).runs
    limited.name = "M"
    assert explore(limited).runs == expected


def test_userdata_whose_parts_know_each_other_is_explored():
    """Places that list their neighbours: the text of 30 was made along each way, and never ended."""
    places = [{"near": []} for _ in range(30)]
    for one, place in enumerate(places):
        place["near"] += [places[one - 1], places[one - 2]]
    sm = sound()
    expected = explore(sm)
    sm.userdata.places = places
    found = explore(sm)
    assert found.exhaustive
    assert found.runs == expected.runs


def test_the_machine_is_as_it_was_afterwards():
    sm = sound()
    before = dict(sm.get_children())
    sm.userdata.x = [1]
    explore(sm)
    assert sm.get_children() == before
    assert sm.userdata.x == [1]


def test_bounds_say_that_there_is_more():
    found = explore(sound(), max_runs=3)
    assert (found.ok, found.exhaustive, found.runs, found.stopped_by) == (
        True,
        False,
        3,
        "max_runs",
    )
    found = explore(sound(), max_time=0.0)
    assert (found.exhaustive, found.runs, found.stopped_by) == (False, 1, "max_time")
    found = explore(sound(), max_depth=1)
    assert (found.exhaustive, found.stopped_by) == (False, "max_depth")


def test_an_invariant_of_one_s_own_and_the_shortest_run_that_breaks_it():
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("SPIN", Leaf("again", "on"), {"again": "SPIN", "on": "PICK"})
        sm.add("PICK", Leaf("picked", "missed"), {"picked": "CARRY", "missed": "SPIN"})
        sm.add("CARRY", Leaf("dropped", "held"), {"dropped": "SPIN", "held": "done"})

    def never_drops(run):
        return "dropped" not in run.outcomes("CARRY")

    found = explore(sm, invariants=[never_drops], preempts=0)
    assert not found.ok
    example = found.counterexample
    assert "never_drops" in example.reason
    assert "-dropped->" in example.run.explain()
    assert example.run.path[:3] == ("/M/SPIN", "/M/PICK", "/M/CARRY")
    assert "'/M/SPIN: on'" in example.script
    assert replay(sm, example.choices, preempts=0).outcomes("CARRY")[0] == "dropped"


def test_the_script_repeats_the_run(tmp_path):
    def says_failed(run):
        assert run.outcome != "failed", "it failed"

    found = explore(broken_machine, invariants=[says_failed])
    script = found.counterexample.script.replace(broken_machine.__module__, "planted")
    assert f"from {broken_machine.__module__} import broken_machine as machine" in (
        found.counterexample.script
    )
    space = {}
    import types

    module = types.ModuleType("planted")
    module.broken_machine = broken_machine
    sys.modules["planted"] = module
    try:
        exec(script, space)
    finally:
        del sys.modules["planted"]
    assert space["run"].outcome == "failed"


def broken_machine():
    return sound()


def test_the_picture_of_a_counterexample(mission):
    found = mission.explore(sound, invariants=[lambda run: run.outcome != "failed"])
    assert "<svg" in found.counterexample.picture.read_text()
    assert str(found.counterexample.picture) in str(found)


# -- planted bugs ----------------------------------------------------------------------------------


def reason(found):
    assert not found.ok
    return found.counterexample.reason


def test_a_loop_with_no_way_out():
    sm = StateMachine(["done"], name="M")
    with sm.opened(check=False):
        sm.add("A", Leaf("ok", "odd"), {"ok": "done", "odd": "B"})
        sm.add("B", Leaf("ok"), {"ok": "B"})
    found = explore(sm, preempts=0)
    assert reason(found).startswith("it never ends")
    assert found.counterexample.choices[0] == "/M/A: odd"


@pytest.mark.parametrize("outcomes", [["done"], ["done", "preempted"]])
def test_a_loop_in_which_no_time_passes(outcomes):
    sm = StateMachine(outcomes, name="M")
    with sm.opened(check=False):
        sm.add("A", CBState(lambda _: "again", outcomes=["again"]), {"again": "A"})
    found = explore(sm, keep=["A"], max_time=0.5, steps=10_000)
    assert reason(found).startswith("it never ends: /M: it took 10000 steps at 0 s, in /M/A")
    assert "or try explore(..., steps=...)" in reason(found)


def through(item, count):
    each = Iterator(
        ["done", "preempted"], [], [], it=range(count), it_label="n", exhausted_outcome="done"
    )
    with each:
        Iterator.set_contained_state("DO", item, ["done"])
    return each


def test_many_items_in_no_time_are_no_run_that_never_ends():
    each = through(CBState(lambda _: "done", outcomes=["done"]), 4000)
    assert explore(each, keep=["DO"], preempts=0).ok
    found = explore(each, keep=["DO"], preempts=0, steps=3000, max_time=0.1)
    assert "it took 3000 steps at 0 s" in reason(found)
    assert "    steps=3000,\n" in found.counterexample.script
    with pytest.raises(TimeLimitError, match=r"took 3000 steps .* or try replay\(..., steps="):
        replay(each, [], keep=["DO"], preempts=0, steps=3000)


def test_turns_in_no_time_are_told_as_turns():
    both = Concurrence(["done"], "done")
    with both:
        for name in "ABC":
            both.add(name, CBState(lambda _: "done", outcomes=["done"]))
    each = through(both, 30)
    assert explore(each, keep=["DO"], preempts=0, max_runs=1).ok
    found = explore(each, keep=["DO"], preempts=0, steps=300, max_time=0.1)
    assert "its threads took 60 turns (5 steps each) at 0 s" in reason(found)


def test_a_kept_leaf_may_take_hours_if_the_test_says_so():
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("A", CBState(lambda _: time.sleep(5000) or "done", outcomes=["done"]))
    found = explore(sm, keep=["A"], preempts=0)
    assert "it still ran after 3600 s, in /M/A" in reason(found)
    assert "Try explore(..., limit=...)" in reason(found)
    assert explore(sm, keep=["A"], preempts=0, limit=6000.0).ok
    assert replay(sm, [], keep=["A"], preempts=0, limit=6000.0).duration == 5000


def test_a_watcher_that_nobody_calls_off():
    both = Concurrence(["done", "preempted"], "done", name="C")
    watcher = Leaf("heard", "preempted")
    watcher.__class__ = type("Watcher", (Leaf,), {"_smachpy_kind": "monitor"})
    with both:
        both.add("GO", Leaf())
        both.add("WATCH", watcher)
    found = explore(both, preempts=0)
    assert reason(found).startswith("it never ends")
    assert any("never finishes" in choice for choice in found.counterexample.choices)
    both._smachpy.child_termination_cb = lambda _: True
    assert explore(both, preempts=0).ok


def test_a_state_that_hangs_is_found_when_it_is_asked_for():
    assert explore(sound(), faults=["hang"]).counterexample.reason.startswith("it never ends")
    assert explore(sound()).ok


def test_an_exception_that_nobody_catches():
    assert "raised by the test" in reason(explore(sound(), faults=["raise"]))
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("A", Leaf("done", "preempted", on_exception={RuntimeError: "done"}))
    assert explore(sm, faults=["raise"]).ok


def test_a_state_that_ignores_its_preempt():
    found = explore(sound(), faults=["deaf"])
    assert "a preempt takes 10 s, /M/" in reason(found)


def test_a_mission_that_goes_on_after_a_preempt():
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("DRIVE", Leaf("done", "preempted"), {"preempted": "WANDER"})
        for number in range(20):
            label = f"W{number}" if number else "WANDER"
            sm.add(label, Leaf("done"), {"done": f"W{number + 1}" if number < 19 else "done"})
    found = explore(sm)
    assert "a preempt takes 20 s" in reason(found)
    assert found.counterexample.choices == ("/M/DRIVE: is preempted",)


def test_a_timeout_is_reached():
    sm = StateMachine(["done", "late", "preempted"], name="M")
    with sm:
        sm.add("A", Leaf(timeout=5.0, timeout_outcome="late"), {"late": "B"})
        sm.add("B", Leaf("done", "stuck"), {"stuck": "B"})
    found = explore(sm, invariants=[lambda run: not run.timed_out("A")])
    assert "/M/A: never finishes" in found.counterexample.choices


def test_an_order_that_only_one_interleaving_has():
    both = Concurrence(["done"], "done", name="C")
    with both:
        both.add("A", Leaf("done"))
        both.add("B", Leaf("done"))

    def a_ends_first(run):
        ended = [e.path for e in run.events if type(e).__name__ == "Left"]
        return ended.index("/C/A") < ended.index("/C/B")

    found = explore(both, preempts=0, invariants=[a_ends_first])
    assert any(choice.startswith("turn: ") for choice in found.counterexample.choices)
    assert explore(both, preempts=0, invariants=[a_ends_first], interleavings=False).ok


def test_userdata_that_is_wrong_on_one_path():
    def count(ud):
        ud.n += 1
        return "more" if ud.n < 3 else "done"

    sm = StateMachine(["done", "preempted"], name="M")
    sm.userdata.n = 0
    with sm:
        sm.add("COUNT", CBState(count, outcomes=["more", "done"], io_keys=["n"]), {"more": "TRY"})
        sm.add("TRY", Leaf("ok", "again"), {"ok": "COUNT", "again": "TRY"})
    found = explore(sm, keep=["COUNT"], preempts=0, invariants=[lambda run: run.userdata["n"] == 3])
    assert found.ok
    found = explore(sm, keep=["COUNT"], preempts=0)
    assert found.exhaustive
    found = explore(
        sm, keep=["COUNT"], userdata={"n": 2}, invariants=[lambda run: run.visits("TRY") > 0]
    )
    assert not found.ok


def test_doubles_write_what_they_are_told():
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("FIND", Leaf("done", output_keys=["pose"]), {"done": "USE"})
        sm.add("USE", CBState(lambda ud: ud.pose, outcomes=["done"], input_keys=["pose"]))
    assert "pose" in reason(explore(sm, keep=["USE"], preempts=0))
    assert explore(sm, keep=["USE"], preempts=0, writes={"/M/FIND": {"pose": "done"}}).ok


def test_items_of_an_iterator_are_part_of_the_situation():
    each = Iterator(["done"], [], [], it=range(3), it_label="i", exhausted_outcome="done")
    each.name = "I"
    with each:
        Iterator.set_contained_state("DO", Leaf("ok", "bad"), ["ok", "bad"])
    found = explore(each, preempts=0)
    assert found.exhaustive
    assert found.runs == 4  # at each of three items the other outcome, once


def drive():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="M")
    with sm:
        state = SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0)
        sm.add("DRIVE", state)
    return sm


def test_everything_that_servers_do():
    found = explore(drive, real_actions=True, preempts=0, interleavings=False)
    found.assert_ok()
    assert found.exhaustive
    assert found.runs == 9

    def never_lost(run):
        return all(getattr(event, "status", "") != "LOST" for event in run.events)

    found = explore(
        drive, real_actions=True, preempts=0, interleavings=False, invariants=[never_lost]
    )
    assert found.counterexample.choices == ("server move_base: dies",)


def test_an_unknown_fault():
    with pytest.raises(ValueError, match="deaf"):
        explore(sound(), faults=["gremlins"])
    with pytest.raises(ValueError, match=r"replay: faults: got \['gremlins'\]"):
        replay(sound(), [], faults=["gremlins"])


def test_an_unknown_option(mission):
    with pytest.raises(TypeError, match="Did you mean 'preempts'"):
        explore(sound(), prempts=0)
    with pytest.raises(TypeError, match="Did you mean 'max_runs'"):
        explore(sound(), max_run=3)
    with pytest.raises(TypeError, match=r"replay: unknown arguments \['max_run'\]"):
        mission.replay(sound(), [], max_run=3)


def test_options_may_be_iterators():
    found = explore(sleeps, keep=iter(["X"]), faults=iter(["hang"]), preempts=0)
    assert found.ok


def test_a_machine_that_has_changed_cannot_be_replayed():
    with pytest.raises(Exception, match="Has the machine changed"):
        replay(sound(), ["/M/A: vanished"])


def test_explored_runs_are_the_same_twice():
    def verdict():
        found = explore(
            sound, invariants=[lambda run: run.outcome != "failed" or run.visits("B") < 1]
        )
        return found.runs, found.counterexample.choices, found.counterexample.run.explain()

    assert len({verdict() for _ in range(3)}) == 1


def test_equal_situations_are_entered_once_and_nothing_is_missed():
    def machine():
        both = Concurrence(
            ["low", "done", "lost", "preempted"],
            "lost",
            outcome_map={"low": {"WATCH": "low"}, "done": {"GO": "done"}},
            child_termination_cb=lambda _: True,
        )
        go = StateMachine(["done", "lost", "preempted"])
        with go:
            go.add("NEXT", Leaf("drive", "end"), {"drive": "DRIVE", "end": "done"})
            go.add("DRIVE", Leaf("there", "lost", "preempted"), {"there": "NEXT"})
        with both:
            both.add("GO", go)
            both.add("WATCH", Leaf("low", "preempted"))
        sm = StateMachine(["done", "lost", "preempted"], name="M")
        with sm:
            sm.add("BOTH", both, {"low": "CHARGE"})
            sm.add("CHARGE", Leaf("full", "lost"), {"full": "BOTH"})
        return sm

    def seen(**options):
        found = set()

        def collect(run):
            found.add(run.outcome)
            found.update((e.path, e.outcome) for e in run.events if type(e).__name__ == "Left")

        return explore(machine(), on_run=collect, grace=1e9, max_depth=40, **options), found

    merged, states = seen()
    assert merged.exhaustive
    everything, all_states = seen(invariants=[lambda run: True], max_runs=400)
    assert everything.runs > 2 * merged.runs
    assert states == all_states


# -- who outlasts whom -----------------------------------------------------------------------------


def beside(termination, **options):
    """A beside S, a chain of B and C."""
    both = Concurrence(["done", "preempted"], "done", child_termination_cb=termination)
    chain = StateMachine(["done", "preempted"])
    with chain:
        chain.add("B", Leaf(), {"done": "C"})
        chain.add("C", Leaf())
    with both:
        both.add("A", Leaf(**options))
        both.add("S", chain)
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("BOTH", both)
    return sm


def planted(outcomes):
    if outcomes["S"] == "done" and outcomes["A"] is None:
        raise ValueError("S ended before A")


@pytest.mark.parametrize("timeout", [None, 60.0])
def test_a_leaf_may_outlast_a_chain_beside_it(timeout):
    found = explore(beside(planted, timeout=timeout), preempts=0)
    assert "ValueError: S ended before A" in reason(found)
    choices = found.counterexample.choices
    assert choices[-1] == "/M/BOTH/A: outlasts the others"
    assert all(choice.startswith("turn: ") for choice in choices[:-1])
    with pytest.raises(Exception, match="S ended before A"):
        replay(beside(planted, timeout=timeout), choices, preempts=0)


def bounded(*, around=None, own=None, inner=None, chain=3):
    """A beside a chain of B0, B1, ...; `inner` is the timeout of B1."""
    late = {} if around is None else {"timeout": around, "timeout_outcome": "late"}
    both = Concurrence(["done", "late", "preempted"], "done", **late)
    after = StateMachine(["done", "aborted", "preempted"])
    with after:
        for n in range(chain):
            limit = {"timeout": inner} if n == 1 else {}
            to = f"B{n + 1}" if n + 1 < chain else "done"
            after.add(f"B{n}", Leaf("done", "aborted", "preempted", **limit), {"done": to})
    with both:
        both.add("A", Leaf("done", "aborted", "preempted", timeout=own))
        both.add("S", after)
    sm = StateMachine(["done", "late", "preempted"], name="M")
    with sm:
        sm.add("BOTH", both)
    return sm


def ends(machine):
    """The result, and in which orders leaves have ended with 'done'."""
    seen = set()

    def note(run):
        ended = [e for e in run.events if type(e).__name__ == "Left" and e.outcome == "done"]
        labels = [e.path.rpartition("/")[2] for e in ended]
        seen.add(" ".join(label for label in labels if label not in {"BOTH", "S"}))
        seen.add(run.outcome)

    return explore(machine, preempts=0, max_runs=5_000, on_run=note), seen


@pytest.mark.parametrize("around", [None, 0.5, 4.0, 60.0])
@pytest.mark.parametrize("own", [None, 0.5])
def test_a_leaf_outlasts_others_within_each_timeout(around, own):
    found, seen = ends(lambda: bounded(around=around, own=own))
    assert found.exhaustive, str(found)
    assert {"A B0 B1 B2", "B0 A B1 B2", "B0 B1 A B2", "B0 B1 B2 A"} <= seen
    assert ("late" in seen) == (around is not None)


@pytest.mark.parametrize("inner", [0.5, 5.0])
def test_a_leaf_with_a_timeout_outlasts_one_that_has_outlasted_others(inner):
    found, seen = ends(lambda: bounded(inner=inner))
    assert found.exhaustive, str(found)
    assert {"A B0 B1 B2", "B0 A B1 B2", "B0 B1 A B2", "B0 B1 B2 A"} <= seen


def test_leaves_that_a_timeout_leaves_no_time_are_named():
    def machine():
        inner = StateMachine(["done", "late", "preempted"], timeout=5.0, timeout_outcome="late")
        with inner:
            for n in range(12):
                inner.add(f"B{n}", Leaf(), {"done": f"B{n + 1}" if n < 11 else "done"})
        sm = StateMachine(["done", "late", "preempted"], name="M")
        with sm:
            sm.add("I", inner)
        return sm

    found, _ = ends(machine)
    assert (found.ok, found.exhaustive, found.stopped_by) == (True, False, "timeout")
    assert found.no_time_for == ("/M/I/B10 to end",)
    assert "not all there are: a timeout leaves no time for /M/I/B10 to end" in str(found)
    found, _ = ends(lambda: bounded(own=0.0001))
    assert found.no_time_for == ("/M/BOTH/A to end",)


def test_a_loop_within_a_timeout_is_explored_to_the_end():
    found, seen = ends(lambda: rounds(5.0))
    assert found.exhaustive, str(found)
    assert "late" in seen


def rounds(seconds):
    inside = StateMachine(["done", "late", "preempted"], timeout=seconds, timeout_outcome="late")
    with inside:
        inside.add("LOOK", Leaf("done", "again", "preempted"), {"again": "LOOK"})
    sm = StateMachine(["done", "late", "preempted"], name="M")
    with sm:
        sm.add("SEARCH", inside)
    return sm


@pytest.mark.parametrize("cleanup", [True, False])
@pytest.mark.parametrize("ends", [("done",), ("done", "preempted")])
def test_the_timeout_of_a_container_is_reached(ends, cleanup):
    inner = StateMachine(["done", "late", "preempted"], timeout=5.0, timeout_outcome="late")
    with inner:
        inner.add("A", Leaf(*ends), {"done": "B"})
        inner.add("B", Leaf(*ends))
    if cleanup:
        inner.add_cleanup("TIDY", Leaf(*ends))
    sm = StateMachine(["done", "late", "preempted"], name="M")
    with sm:
        sm.add("I", inner)
    outcomes = set()
    found = explore(sm, on_run=lambda run: outcomes.add(run.outcome))
    found.assert_ok()
    assert found.exhaustive
    assert {"done", "late"} <= outcomes


def test_leaves_that_run_at_once_end_in_every_order():
    def two():
        both = Concurrence(["done"], "done", name="C")
        with both:
            for label in "AB":
                chain = StateMachine(["done"])
                with chain:
                    chain.add("1", Leaf("done"), {"done": "2"})
                    chain.add("2", Leaf("done"), {"done": "3"})
                    chain.add("3", Leaf("done"))
                both.add(label, chain)
        return both

    orders, steps = set(), set()

    def note(run):
        ends = (e.path[3:] for e in run.events if type(e).__name__ == "Left")
        order = "".join(end[0] for end in ends if "/" in end)
        orders.add(order)
        steps.update(("".join(sorted(order[:i])), end) for i, end in enumerate(order))

    assert explore(two, preempts=0, on_run=note).exhaustive
    assert len(steps) == 24  # in each of 16 places A goes on, or B: each ends in 3 of 4
    assert explore(two, preempts=0, on_run=note, invariants=[lambda _: True]).exhaustive
    assert len(orders) == 20  # 6! / 3! / 3!


def test_the_order_of_ends_is_as_it_comes_when_nobody_asks_for_others():
    found = explore(beside(planted), preempts=0, interleavings=False)
    assert found.exhaustive
    assert found.ok


def test_nothing_outlasts_what_runs_alone():
    longest = []
    assert explore(sound(), on_run=lambda run: longest.append(run.duration)).exhaustive
    assert max(longest) < 20


def test_a_loop_of_long_leaves_is_no_run_that_never_ends(monkeypatch):
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("ROUND", beside(None), {"done": "AGAIN"})
        sm.add("AGAIN", Leaf("done", "again"), {"again": "ROUND"})
    rounds = []

    def choose(self, where, options, *_):
        if "again" in options:
            rounds.append(self._clock.now())
            return options.index("again" if len(rounds) < 25 else "done")
        return options.index("outlasts the others") if "outlasts the others" in options else 0

    monkeypatch.setattr(Explorer, "choose", choose)
    found = explore(sm, preempts=0, max_runs=1)
    found.assert_ok()
    assert rounds[-1] > 3600


def test_a_leaf_that_outlasts_others_after_a_preempt_takes_no_grace():
    sm = beside(None)
    stop = StateMachine(["done", "preempted"], name="R")
    with stop:
        stop.add("WORK", Leaf(), {"preempted": "TIDY"})
        stop.add("TIDY", sm)
    found = explore(stop)
    found.assert_ok()
    assert found.exhaustive


# -- what stays as it is ---------------------------------------------------------------------------


def sleeps():
    def sleep(_userdata):
        time.sleep(300)  # and looks at no preempt
        return "done"

    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("X", CBState(sleep, outcomes=["done", "preempted"]))
    return sm


@pytest.mark.parametrize("options", [{"keep": ["X"]}, {"real_actions": True}])
def test_a_preempt_comes_while_a_kept_leaf_runs(options):
    found = explore(sleeps, **options)
    assert reason(found) == "a preempt takes 10 s, /M/X ignored it; expected at most 10 s"
    choices = ("/M/X: runs as a preempt comes",)
    assert found.counterexample.choices == choices
    assert replay(sleeps, choices, **options).abandoned() == ("/M/X",)
    assert explore(sleeps, preempts=0, **options).ok


def test_a_preempt_that_no_wait_lets_in_is_not_left_for_the_next_run():
    sm = StateMachine(["done", "preempted"], name="M")
    with sm:
        sm.add("X", CBState(lambda _: "done", outcomes=["done"]))
    outcomes = []
    found = explore(sm, keep=["X"], on_run=lambda run: outcomes.append(run.outcome))
    assert found.exhaustive
    assert outcomes == ["done", "done"]
    assert not sm.preempt_requested()


def test_names_of_leaves_are_paths_or_ends_of_paths():
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("FIND", Leaf("done", output_keys=["n"]), {"done": "USE"})
        sm.add("USE", CBState(lambda ud: str(ud.n), outcomes=["done"], input_keys=["n"]))
    assert explore(sm, keep=["USE"], preempts=0, writes={"FIND": {"n": "done"}}).ok
    with pytest.raises(UnknownStateError, match=r"'USED'.*Did you mean 'USE'"):
        explore(sm, keep=["USED"])
    with pytest.raises(UnknownStateError, match="'FIN'"):
        explore(sm, writes={"FIN": {"n": 1}})


def test_a_container_that_is_kept_keeps_all_in_it():
    inner = StateMachine(["done"])
    with inner:
        inner.add("X", CBState(lambda _: "done", outcomes=["done", "odd"]), {"odd": "done"})
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("IN", inner, {"done": "A"})
        sm.add("A", Leaf("done"))
    assert explore(sm, preempts=0).runs == 2
    assert explore(sm, preempts=0, keep=["IN"]).runs == 1


# -- what is wrong with a run ----------------------------------------------------------------------


@pytest.mark.parametrize("answer", [False, 0, "", []])
def test_whatever_is_false_breaks_an_invariant(answer):
    assert "invariant <lambda> does not hold" in reason(
        explore(sound(), invariants=[lambda _: answer])
    )


def test_an_invariant_that_asserts_returns_nothing():
    assert explore(sound(), invariants=[lambda _: None]).ok


def test_an_invariant_that_raises_is_broken():
    found = explore(sound(), invariants=[lambda run: run.userdata["n"] == 1])
    assert reason(found) == "invariant <lambda> raised KeyError: 'n'"


def test_a_run_is_shortened_to_one_that_is_wrong_in_the_same_way():
    sm = StateMachine(["done", "failed", "preempted"], name="M")
    with sm:
        sm.add("A", Leaf("done", "failed", "preempted"), {"failed": "C"})
        sm.add("C", Leaf("done", "failed", "preempted"), {"done": "E", "failed": "E"})
        sm.add("E", Leaf("done", "failed", "preempted"))

    def no_c_before_e(run):
        return not (run.visits("C") and run.visits("E"))

    def no_preempt(run):
        return run.outcome != "preempted"

    for invariants in ([no_c_before_e, no_preempt], [no_preempt, no_c_before_e]):
        found = explore(sm, invariants=invariants, preempts=0)
        assert reason(found) == "invariant no_c_before_e does not hold"
        assert found.counterexample.run.visits("E") == 1


def test_a_run_that_raises_is_shortened_to_one_that_raises_the_same():
    def broken(ud):
        raise TypeError("short") if ud.n else ValueError("long")

    sm = StateMachine(["done"], name="M")
    sm.userdata.n = 0
    with sm.opened(check=False):
        sm.add("A", Leaf("long", "short", "odd"), {"long": "B", "short": "C", "odd": "done"})
        sm.add("B", Leaf("done"), {"done": "X"})
        sm.add("C", CBState(lambda _: 1 / 0, outcomes=["done"]))
        sm.add("X", CBState(broken, outcomes=["done"], input_keys=["n"]))
    found = explore(sm, keep=["C", "X"], preempts=0)
    assert "ValueError: long" in reason(found)


def test_a_counterexample_says_when_the_computer_s_clock_ended_its_shortening(monkeypatch):
    def no_c_before_e(run):
        return not run.visits("B")

    seconds = itertools.count()
    found = explore(sound, invariants=[no_c_before_e])
    assert not found.counterexample.is_cut
    assert "max_time ended" not in str(found)
    monkeypatch.setattr(exploration.COMPUTER, "now", lambda: next(seconds))
    slow = explore(sound, invariants=[no_c_before_e], max_time=4)
    assert slow.counterexample.is_cut
    told = "(max_time ended its shortening: a faster computer may find a shorter one)"
    assert told in str(slow)
    assert explore(sound, invariants=[no_c_before_e], max_time=900).counterexample.choices == (
        found.counterexample.choices
    )


def test_leaves_raise_what_they_and_their_containers_expect():
    class OddError(Exception):
        def __init__(self, one, two):
            super().__init__(one, two)

    def machine():
        inner = StateMachine(["done", "odd"], on_exception={OddError: "odd"})
        with inner:
            inner.add("A", Leaf("done", on_exception={ValueError: "broken"}), {"broken": "done"})
        sm = StateMachine(["done", "odd"], name="M")
        with sm:
            sm.add("IN", inner)
        return sm

    for text, left in [("ValueError", "/M/IN/A -broken->"), ("OddError", "/M/IN -odd->")]:
        run = replay(machine, [f"/M/IN/A: raises {text}"], preempts=0, faults=["raise"])
        assert left in run.explain()
    outcomes = set()
    found = explore(
        machine, preempts=0, faults=["raise"], on_run=lambda run: outcomes.add(run.outcome)
    )
    assert "RuntimeError: raised by the test" in reason(found)  # which nobody expects


@pytest.mark.parametrize("deep", [False, True])
@pytest.mark.parametrize("interleavings", [False, True])
def test_what_a_leaf_raised_is_part_of_the_situation_beside_it(deep, interleavings):
    """Beside a leaf that raised a ValueError not all is seen that was after a RuntimeError."""
    broken = StateMachine(["done"])
    with broken:
        broken.add("RAISES", Leaf("done"))
    beside = StateMachine(["done", "other"], on_exception={Exception: "other"})
    with beside:
        beside.add("LONG", Leaf("on"), {"on": "END"})
        beside.add("END", Leaf("done", "other"))
    kinds = {RuntimeError: "runtime", ValueError: "value"}
    both = Concurrence(["done", "runtime", "value"], "done", on_exception=kinds)
    with both:
        both.add("A", broken if deep else Leaf("done"))
        both.add("B", beside)
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("BOTH", both, {"runtime": "done", "value": "VALUE"})
        sm.add("VALUE", Leaf("ok", "odd"), {"ok": "done", "odd": "TRAP"})
        sm.add("TRAP", CBState(lambda _: 1 / 0, outcomes=["done"]))
    found = explore(sm, faults=["raise"], keep=["TRAP"], preempts=0, interleavings=interleavings)
    assert "ZeroDivisionError" in reason(found)


@pytest.mark.parametrize("is_root", [False, True])
def test_the_attempts_of_a_container_are_part_of_the_situation(is_root):
    options = {"retry": (2, 0.0, RuntimeError), "on_exception": {RuntimeError: "failed"}}
    inner = StateMachine(["done", "failed"], **options)
    with inner:
        inner.add("A", Leaf("done"), {"done": "B"})
        inner.add("B", Leaf("done"))
    outer = StateMachine(["done", "failed"], name="M")
    with outer:
        outer.add("IN", inner)
    machine = inner if is_root else outer
    seen = set()

    def explored(**options):
        found = explore(
            machine,
            faults=["raise"],
            preempts=0,
            on_run=lambda run: seen.add((run.path[-1], run.outcome)),
            **options,
        )
        assert found.exhaustive
        runs = set(seen)
        seen.clear()
        return runs

    every = explored(invariants=[lambda _: True])  # which compares no situations
    assert len(every) == 3  # done, or failed in the second A or B
    assert explored() == every


class NewError(Exception):
    def __new__(cls, one, two):
        return super().__new__(cls, one, two)


class TextError(Exception):
    def __init__(self, one, two):
        self.text = f"{one}, {two}"

    def __str__(self):
        return self.text


@pytest.mark.parametrize("kind", [ExceptionGroup, NewError, TextError])
def test_exceptions_that_cannot_be_made_are_left_out_and_told(kind):
    def machine(**options):
        sm = StateMachine(["done"], name="M")
        with sm:
            sm.add("A", Leaf("done", **options), {"done": "B"})
            sm.add("B", Leaf("done", **options))
        return sm

    kinds = {RuntimeError: "done", kind: "done", ValueError: "done"}
    found = explore(machine(on_exception=kinds), faults=["raise"], preempts=0)
    assert (found.ok, found.exhaustive) == (True, True)
    assert found.not_raised == (kind.__name__,)
    told = f"all there are: no counterexample (not raised, as they want arguments: {kind.__name__})"
    assert told in str(found)
    found = explore(machine(retry=(1, 0.0, kind)), faults=["raise"], preempts=0)
    assert "RuntimeError: raised by the test" in reason(found)  # and no TypeError
    assert f"stopped by counterexample (not raised, as they want arguments: {kind.__name__})" in (
        str(found)
    )
    assert explore(machine(on_exception=kinds), preempts=0).not_raised == ()


def test_a_value_that_no_double_has_written_is_told_with_the_way_out():
    def machine():
        each = Iterator(
            ["done", "preempted"],
            ["shelves"],
            [],
            it=lambda: each.userdata.shelves,
            it_label="shelf",
            exhausted_outcome="done",
        )
        with each:
            Iterator.set_contained_state("DO", Leaf("ok"), ["ok"])
        sm = StateMachine(["done", "preempted"], name="M")
        with sm:
            find = Leaf("done", output_keys=["found"])
            sm.add("FIND", find, {"done": "EACH"}, {"found": "shelves"})
            sm.add("EACH", each)
        return sm

    found = explore(machine, preempts=0)
    assert "userdata key has no value" in reason(found)
    assert "explore(..., writes={'/M/FIND': {'found': ...}})" in reason(found)
    assert explore(machine, preempts=0, writes={"FIND": {"found": [1, 2]}}).ok


@pytest.mark.slow
def test_machines_of_a_function_are_let_go():
    made, alive = [], []

    def machine():
        made.append(weakref.ref(sm := sound()))
        return sm

    def count(_run):
        gc.collect()
        alive.append(sum(ref() is not None for ref in made))

    explore(machine, max_runs=4, on_run=count)
    assert alive == [1] * 4


# -- with what the test has prepared ---------------------------------------------------------------


def test_doubles_of_the_test_stay_where_they_are(mission):
    made = mission.replace("A", outcomes=["failed", "done"])
    sm = sound()
    before = dict(sm.get_children())
    for machine in (sm, sound):
        found = mission.explore(machine, invariants=[lambda run: run.outcomes("A") == ("failed",)])
        found.assert_ok()
        assert len(made) == 1
    assert sm.get_children() == before
    assert mission(sm).outcomes("A") == ("failed",)
    assert mission.explore(sm, invariants=[lambda run: set(run.outcomes("A")) == {"done"}]).ok
    assert made[-1].script == ("done",)


def test_a_run_with_doubles_of_the_test_is_repeated_by_the_test(mission):
    mission.replace("A", outcomes=["done"])
    found = mission.explore(sound, preempts=0, invariants=[lambda run: run.visits("A") < 2])
    assert "mission.replace(...) of A" in found.counterexample.script
    assert "run = mission.replay(" in found.counterexample.script
    run = mission.replay(sound, found.counterexample.choices, preempts=0)
    assert run.outcomes("B")[0] == "again"


def test_a_preempt_of_the_test_is_refused(mission):
    mission.preempt(on="A")
    with pytest.raises(ValueError, match=r"mission\.explore: got preempt\(on='A'\)"):
        mission.explore(sound())


def test_what_is_no_machine_is_refused(mission):
    for call, wrong in [
        (mission, ()),
        (mission, (mission,)),
        (mission, (sound,)),
        (mission, (5,)),
        (mission.explore, (mission,)),
        (mission.explore, (5,)),
        (mission.explore, (StateMachine,)),
        (explore, (None,)),
    ]:
        with pytest.raises(TypeError, match=r"expected a (machine|container)"):
            call(*wrong)


def drive_with_a_client():
    """ASK is code of the user's own that sends a goal, and SEE waits for a message."""

    def ask(userdata):
        client = SimpleActionClient("move_base", MoveBaseAction)
        if not client.wait_for_server(5.0):
            return "no_server"
        client.send_goal_and_wait(MoveBaseGoal())
        return client.get_goal_status_text() or "no_text"

    sm = StateMachine(["seen", "not_seen", "no_server"], name="M")
    with sm:
        outcomes = ["first", "second", "no_server", "no_text"]
        ends = {"first": "ASK", "second": "SEE", "no_text": "no_server"}
        sm.add("ASK", CBState(ask, outcomes=outcomes), ends)
        sm.add(
            "SEE",
            MonitorState("seen", Empty, lambda ud, message: False, timeout=5.0),
            {"invalid": "seen", **dict.fromkeys(["valid", "aborted", "preempted"], "not_seen")},
        )
    return sm


@pytest.mark.slow
def test_servers_and_topics_of_the_test_are_in_each_run(mission, action_server, topic):
    server = action_server("move_base", MoveBaseAction)
    server.reply(text="first", duration=1)
    server.reply(text="second", duration=1)
    topic("seen", Empty).publish_at(4.0)
    outcomes = []
    for machine in (drive_with_a_client, drive_with_a_client()):
        found = mission.explore(
            machine,
            keep=["ASK", "SEE"],
            preempts=0,
            on_run=lambda run: outcomes.append(run.outcome),
        )
        found.assert_ok()
    assert set(outcomes) == {"seen"}
    assert server.goals == []
    mission(drive_with_a_client()).assert_outcome("seen")


def test_a_run_with_servers_of_the_test_is_repeated_by_the_test(mission, action_server):
    action_server("move_base", MoveBaseAction).default_result(status="aborted", text="second")
    options = {"keep": ["ASK"], "preempts": 0}
    found = mission.explore(
        drive_with_a_client, invariants=[lambda run: run.outcome != "not_seen"], **options
    )
    assert "mission.replay(" in found.counterexample.script
    run = mission.replay(drive_with_a_client, found.counterexample.choices, **options)
    run.assert_outcome("not_seen")


def test_what_a_server_still_has_to_do_is_part_of_the_situation(mission, action_server):
    """PICK is entered in one situation but for the server: its second goal is bad for LEFT."""

    def ask(userdata):
        client = SimpleActionClient("move_base", MoveBaseAction)
        client.send_goal_and_wait(MoveBaseGoal())
        return client.get_goal_status_text()

    def left(userdata):
        text = ask(userdata)
        if text == "second":
            raise ValueError(text)
        return "done" if text == "end" else "again"

    def right(userdata):
        return "done" if ask(userdata) == "end" else "again"

    def asks():
        sm = StateMachine(["done", "preempted"], name="M")
        with sm:
            sm.add("PICK", Leaf("left", "right"), {"left": "LEFT", "right": "RIGHT"})
            for label, function in (("LEFT", left), ("RIGHT", right)):
                sm.add(label, CBState(function, outcomes=["again", "done"]), {"again": "PICK"})
        return sm

    server = action_server("move_base", MoveBaseAction)
    for text in ("first", "second"):
        server.reply(text=text)
    server.default_result(text="end")
    found = mission.explore(asks, keep=["LEFT", "RIGHT"], preempts=0, interleavings=False)
    assert "ValueError" in reason(found)


# -- what a counterexample says --------------------------------------------------------------------


def never_ends_well(run):
    return False


of_a_line = lambda: sound()  # noqa: E731  a name for a lambda is what is tested


@pytest.mark.parametrize(
    "make", [sound, of_a_line, lambda: sound(), Makes("of a class").make, sound()]
)
def test_a_script_is_a_program_whatever_made_the_machine(make):
    found = explore(
        make, invariants=[never_ends_well], writes={"A": {}}, userdata={"pose": object()}
    )
    script = found.counterexample.script
    compile(script, "script", "exec")
    assert ("import sound as machine" in script) == (make is sound)
    assert ("import of_a_line as machine" in script) == (make is of_a_line)
    assert "userdata=...,  # as it was given to explore: {'pose': <object" in script


def test_a_program_s_own_function_is_imported_from_its_file(tmp_path):
    (tmp_path / "night.py").write_text(
        "from smachpy import CBState, StateMachine\n"
        "from smachpy.testing import explore\n"
        "def make():\n"
        "    sm = StateMachine(['done'])\n"
        "    with sm:\n"
        "        sm.add('A', CBState(print, outcomes=['done']))\n"
        "    return sm\n"
        "if __name__ == '__main__':\n"
        "    print(explore(make, invariants=[lambda run: False]).counterexample.script)\n"
    )
    words = [sys.executable, "night.py"]
    script = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "from night import make as machine" in script
    words = [sys.executable, "-c", script]
    shown = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert "-done->" in shown


def test_assert_ok_fails_with_the_whole_counterexample():
    explore(sound).assert_ok()
    found = explore(sound, invariants=[never_ends_well])
    with pytest.raises(AssertionError) as error:
        found.assert_ok()
    assert str(error.value) == str(found)
    assert found.counterexample.script in str(error.value)


# -- what is found with real actions ---------------------------------------------------------------


def forgets_a_goal():
    """START sends a goal of its own and does not look after it."""

    def start(_userdata):
        client = SimpleActionClient("move_base", MoveBaseAction)
        assert client.wait_for_server(5.0)
        client.send_goal(MoveBaseGoal())
        return "started"

    sm = drive()
    with sm:
        sm.add("START", CBState(start, outcomes=["started"]), {"started": "DRIVE"})
    sm.set_initial_state(["START"])
    return sm


def test_a_goal_that_is_left_running():
    found = explore(forgets_a_goal, real_actions=True, preempts=0, interleavings=False)
    assert "goals are left running: /mission-" in reason(found)
    assert replay(
        forgets_a_goal,
        found.counterexample.choices,
        real_actions=True,
        preempts=0,
        interleavings=False,
    ).outcome


class Sends(State):
    """Sends a goal, and cancels it if it is told so; it ends before either has arrived."""

    def __init__(self, *, cancels):
        super().__init__(["done"])
        self.cancels = cancels

    def execute(self, ud):
        client = SimpleActionClient("move_base", MoveBaseAction)
        client.wait_for_server(5.0)
        client.send_goal(MoveBaseGoal())
        if self.cancels:
            client.cancel_goal()
        return "done"


def sends(*, cancels):
    sm = StateMachine(["done"], name="M")
    with sm:
        sm.add("SEND", Sends(cancels=cancels))
    return sm


@pytest.mark.parametrize("cancels", [False, True])
def test_a_goal_of_plain_code_that_the_mission_leaves_to_a_server(cancels):
    found = explore(lambda: sends(cancels=cancels), keep=["SEND"], real_actions=True)
    assert found.ok == cancels
    assert cancels or "goals are left running: /mission-" in reason(found)
    with mission_kit() as mission:
        server = mission.action_server("move_base", MoveBaseAction)
        server.default_result(duration=600)
        run = mission(sends(cancels=cancels))
        assert (len(server.goals), len(server.cancelled)) == (1, int(cancels))
        assert len(run.goals_left) == (not cancels)
        assert run.goals_left == server.left
        assert run.duration < 1


def test_preempts_come_while_a_server_works():
    outcomes = set()
    found = explore(
        drive,
        real_actions=True,
        interleavings=False,
        on_run=lambda run: outcomes.update(run.outcomes("DRIVE")),
    )
    found.assert_ok()
    assert found.exhaustive
    assert found.runs == 11
    assert "preempted" in outcomes


def test_what_servers_did_before_makes_two_situations_differ():
    def machine():
        sm = drive()
        with sm:
            sm.add("NOTE", CBState(lambda _: "noted", outcomes=["noted"]), {"noted": "DRIVE"})
            state = SimpleActionState("move_base", MoveBaseAction, exec_timeout=60.0)
            sm.add("FIRST", state, {"aborted": "NOTE"})
        sm.set_initial_state(["FIRST"])
        return sm

    ends = set()

    def note(run):
        ends.add(tuple(e.status for e in run.events if type(e).__name__ == "GoalDone"))

    found = explore(machine, real_actions=True, interleavings=False, on_run=note)
    assert found.exhaustive
    both = {"ABORTED", "REJECTED", "LOST"}
    assert ends >= {(first, second) for first in both for second in {*both, "SUCCEEDED"}}


def test_a_server_that_ignores_the_cancel_of_a_preempt_for_too_long():
    found = explore(drive, real_actions=True, interleavings=False, grace=1.5)
    assert "a preempt takes 2 s" in reason(found)
    assert found.counterexample.choices == (
        "server move_base: works as a preempt comes, and ignores the cancel",
    )


class Unreadable:
    def __repr__(self):
        raise RuntimeError


@pytest.mark.parametrize("by", ["machine", "argument"])
def test_values_that_cannot_be_copied_are_shared_by_all_runs(by):
    """The exploration ended with "cannot pickle '_thread.lock' object"."""
    sizes = []

    def append(userdata):
        userdata.visits.append(1)
        sizes.append(len(userdata.visits))
        assert userdata.same is userdata.visits
        return "done"

    def make():
        machine = StateMachine(["done", "failed", "preempted"], name="M")
        if by == "machine":
            machine.userdata.update(values)
        with machine:
            machine.add(
                "A",
                CBState(append, outcomes=["done"], io_keys=["visits", "same", "camera"]),
                {"done": "B"},
            )
            machine.add("B", Leaf("done", "failed", "preempted"))
        return machine

    visits = []
    camera = {"visits": visits, "lock": threading.Lock(), "text": Unreadable()}
    values = {"camera": camera, "visits": visits, "same": visits}
    found = explore(make, keep=["A"], userdata=values if by == "argument" else {})
    found.assert_ok()
    assert found.exhaustive
    assert set(sizes) == {1}
    assert visits == []


async def waits(run):
    raise AssertionError


def yields(run):
    yield
    raise AssertionError


@pytest.mark.parametrize(
    ("invariants", "problem"),
    [
        ([waits], "not an async one"),
        ([yields], "without `yield`"),
        ([3], r"invariants\[0\]: got 3"),
        ([lambda: None], r"expected something to call as invariant\(run\)"),
        (yields, r"got yields; expected a list. Try \[yields\]"),
    ],
)
def test_invariants_that_could_never_fail_are_refused(invariants, problem):
    with pytest.raises(InvalidStateError, match=problem):
        explore(sound(), invariants=invariants)


def test_a_function_that_returns_no_machine_is_named():
    def make():
        sound()

    with pytest.raises(TypeError, match=r"make\(\) returned None; expected .* Try `return`"):
        explore(make)


class Sighting:
    def __getstate__(self):
        return {"seen": self.seen}


def test_what_follows_a_value_that_cannot_be_copied_is_copied():
    """It was shared as well, as its state got the address of a dict that `deepcopy` had noted."""
    marks = []

    def note(userdata):
        marks.extend(sighting.seen for sighting in userdata.after)
        for sighting in userdata.after:
            sighting.seen = True
        return "done"

    machine = StateMachine(["done", "failed", "preempted"], name="M")
    with machine:
        keys = ["before", "again", "lock", "after"]
        machine.add("A", CBState(note, outcomes=["done"], io_keys=keys), {"done": "B"})
        machine.add("B", Leaf("done", "failed", "preempted"))
    sightings = [Sighting() for _ in range(3)]
    for sighting in sightings:
        sighting.seen = False
    values = {"before": [1], "again": [2], "lock": [threading.Lock()], "after": sightings}
    explore(machine, keep=["A"], userdata=values).assert_ok()
    assert not any(marks)
    assert not any(sighting.seen for sighting in sightings)


def test_a_machine_that_goes_on_is_explored_from_its_begin_each_time():
    """Given as an object, it went on in each run where the one before had been interrupted."""

    def make():
        sm = StateMachine(["done", "preempted"], name="M", reenter="last")
        for label, target in [("A", "B"), ("B", "C"), ("C", "done")]:
            sm.add(label, Leaf("ok", "preempted"), {"ok": target})
        return sm

    def ways(machine):
        runs = []
        assert explore(machine, on_run=runs.append).exhaustive
        return {(run.outcome, *run.path) for run in runs}

    assert ways(make()) == ways(make)


@dataclass
class Tally:
    n: int = field(default=0, repr=False)


@pytest.mark.parametrize("hidden", ["field", "in a list", "array"])
def test_what_the_repr_of_a_value_leaves_out_makes_situations_different(hidden):
    """The search called itself exhaustive, and never came to the third round."""

    def count(userdata):
        found = userdata.tally
        if hidden == "array":
            found[1000] += 1
            return "many" if found[1000] == 3 else "more"
        one = found[0] if hidden == "in a list" else found
        one.n += 1
        return "many" if one.n == 3 else "more"

    def make():
        first = {"field": Tally, "in a list": lambda: [Tally()], "array": lambda: np.zeros(2001)}
        sm = StateMachine(["bad", "stop", "preempted"], name="M")
        sm.userdata.tally = first[hidden]()
        counts = CBState(count, outcomes=["more", "many"], io_keys=["tally"])
        sm.add("COUNT", counts, {"more": "AGAIN", "many": "bad"})
        sm.add("AGAIN", Leaf("again", "stop"), {"again": "COUNT"})
        return sm

    runs = []
    assert explore(make, keep=["COUNT"], on_run=runs.append).exhaustive
    assert "bad" in {run.outcome for run in runs}
