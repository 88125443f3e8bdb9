"""Branches that wait for each other: all of them go on together, and none waits for ever."""

from __future__ import annotations

from typing import Any

import pytest

import smachpy
from actionlib_core.clock import VirtualClock, use_clock
from smachpy import Concurrence, InvalidStateError, InvalidUserCodeError, State, StateMachine
from smachpy.engine.interrupt import Interruption
from smachpy.states import Barrier, Wait, barrier
from smachpy.testing import explore, mission_kit
from tests.smachpy.durable.killing_store import Kill, KillingStore

ENDS = ["done", "aborted", "preempted"]


def branch_of(*states: State) -> StateMachine:
    """A branch that goes on after 'done' only."""
    machine = StateMachine(ENDS)
    for number, state in enumerate(states):
        following = "done" if state is states[-1] else f"S{number + 1}"
        machine.add(f"S{number}", state, {"done": following})
    return machine


def together(*branches: State, name: str = "C") -> Concurrence:
    both = Concurrence(
        ENDS, "done", outcome_map={"aborted": smachpy.any_of({"A": "aborted"})}, name=name
    )
    for label, branch in zip("ABC", branches, strict=False):
        both.add(label, branch)
    return both


def loader(*seconds: float, **options: Any) -> StateMachine:
    """A branch that comes to the barrier after each of these times."""
    return branch_of(*(s for each in seconds for s in (Wait(each), Barrier("LOADED", **options))))


def test_they_go_on_when_all_have_come():
    with mission_kit() as mission:
        run = mission(together(loader(2.0), loader(5.0)))
    assert (run.outcome, run.duration) == ("done", 5.0)


def test_they_meet_again_and_again():
    with mission_kit() as mission:
        run = mission(together(loader(2.0, 1.0, 7.0), loader(5.0, 3.0, 1.0)))
    assert (run.outcome, run.duration) == ("done", 5.0 + 3.0 + 7.0)


def test_three_wait_for_the_last():
    each = [loader(seconds, parties=3) for seconds in (1.0, 2.0, 9.0)]
    with mission_kit() as mission:
        run = mission(together(*each))
    assert (run.outcome, run.duration) == ("done", 9.0)


def test_a_branch_that_ends_without_coming_lets_the_others_go_at_once():
    with mission_kit() as mission:
        run = mission(together(loader(2.0), branch_of(Wait(5.0))))
    assert (run.outcome, run.duration) == ("aborted", 5.0)


def test_one_that_comes_after_the_others_have_ended_does_not_wait():
    with mission_kit() as mission:
        run = mission(together(loader(9.0), branch_of(Wait(5.0))))
    assert (run.outcome, run.duration) == ("aborted", 9.0)


def test_a_branch_that_raises_lets_the_others_go():
    class Raises(State):
        def __init__(self) -> None:
            super().__init__(["done"])

        def execute(self, userdata: Any) -> str:
            self.sleep(3.0)
            raise OSError("no such shelf")

    clock = VirtualClock()
    with use_clock(clock), pytest.raises(InvalidUserCodeError, match="no such shelf"):
        together(loader(1.0), branch_of(Raises())).execute()
    assert clock.now() == 3.0


def test_two_that_wait_at_different_barriers_do_not_wait_for_ever():
    other = branch_of(Wait(2.0), Barrier("SWEPT"))
    with mission_kit() as mission:
        run = mission(together(loader(1.0), other))
    assert (run.outcome, run.duration) == ("aborted", 2.0)


def test_a_request_to_stop_reaches_those_that_wait():
    with mission_kit() as mission:
        mission.preempt(at=3.0)
        run = mission(together(loader(1.0), loader(60.0)))
    assert (run.outcome, run.duration) == ("preempted", 3.0)


def test_a_timeout_ends_the_wait_and_the_others_may_still_meet():
    machine = StateMachine(ENDS)
    machine.add("LOAD", Barrier("LOADED", timeout=2.0), {"done": "done", "aborted": "LATE"})
    machine.add("LATE", Wait(1.0), {"done": "LOAD"})
    with mission_kit() as mission:
        run = mission(together(machine, loader(4.0)))
    assert (run.outcome, run.duration) == ("done", 4.0)
    assert run.visits("LOAD") == 2


def test_nobody_waits_where_all_have_left_so_another_number_may_meet_there():
    machine = StateMachine(ENDS)
    machine.add("ONE", Barrier("LOADED", 3, timeout=1.0), {"aborted": "WAIT"})
    machine.add("WAIT", Wait(1.0), {"done": "TWO"})
    machine.add("TWO", Barrier("LOADED", 2))
    with mission_kit() as mission:
        run = mission(together(machine, loader(4.0), branch_of(Wait(9.0))))
    assert (run.outcome, run.duration) == ("done", 9.0)


def test_the_last_one_that_is_interrupted_as_it_comes_lets_the_others_go(monkeypatch):
    """They waited for ever, and no request to stop reached them."""
    real = barrier._Meetings.join

    def join(self, *arguments: Any) -> Any:
        meeting = real(self, *arguments)
        if meeting.outcome:
            raise Interruption  # its grace is over
        return meeting

    monkeypatch.setattr(barrier._Meetings, "join", join)
    clock = VirtualClock()
    with use_clock(clock):
        assert together(loader(2.0), loader(5.0)).execute() == "done"
    assert clock.now() == 5.0


def test_the_nearest_concurrence_counts():
    inner = [branch_of(Barrier("LOADED"), Wait(1.0)) for _ in range(2)]
    with mission_kit() as mission:
        run = mission(together(together(*inner), loader(4.0)))
    assert (run.outcome, run.duration) == ("done", 4.0)


@pytest.mark.parametrize(
    ("branches", "problem"),
    [
        ([loader(1.0, parties=3), loader(1.0, parties=3)], "got 3; expected at most 2"),
        ([loader(1.0), loader(2.0, parties=3), Wait(9.0)], "got 3; expected 2, as in another"),
    ],
)
def test_parties_that_do_not_fit_are_an_error(branches, problem):
    with use_clock(VirtualClock()), pytest.raises(InvalidUserCodeError, match=problem):
        together(*branches).execute()


def test_it_needs_a_concurrence_above():
    machine = StateMachine(ENDS, name="M")
    machine.add("LOAD", Barrier("LOADED"))
    with pytest.raises(InvalidStateError, match="/M/LOAD: barrier 'LOADED': got no concurrence"):
        machine.execute()


@pytest.mark.parametrize("arguments", [("", 2), ("LOADED", 1), ("LOADED", 2.5), ("LOADED", True)])
def test_arguments_that_make_no_sense_are_refused(arguments):
    with pytest.raises(InvalidStateError, match="Barrier"):
        Barrier(*arguments)


def test_every_order_and_moment_of_a_request_ends():
    for seed in range(60):
        clock = VirtualClock(seed=seed)
        both = together(loader(1.0, 1.0), loader(1.0, 1.0))
        with use_clock(clock):
            clock.call_later(float(seed % 3), both.request_preempt)
            assert both.execute() in {"done", "preempted"}
        assert not any(child._preempt_requested for child in both.get_children().values())


def test_exploration_knows_it():
    found = explore(lambda: together(loader(1.0), loader(2.0)), preempts=1)
    assert found.exhaustive


def live(root: Any, store: KillingStore) -> str | None:
    """Run, or go on, in a process of its own; None: it was killed."""
    try:
        with VirtualClock() as clock, use_clock(clock):
            return smachpy.run_durable(root, store, mission="m")
    except Kill:
        return None


MISSIONS = {
    "once": lambda: together(loader(1.0), loader(2.0)),
    "again": lambda: together(loader(1.0, 1.0), loader(2.0, 3.0)),
    "not": lambda: together(loader(1.0), branch_of(Wait(2.0))),
    "below": lambda: branch_of(Wait(1.0), together(loader(1.0), loader(2.0))),
}


@pytest.mark.parametrize("kind", MISSIONS)
def test_killed_at_any_write_all_have_met_or_none(kind):
    make, store = MISSIONS[kind], KillingStore()
    outcome = live(make(), store)
    assert outcome == ("aborted" if kind == "not" else "done")
    for kill_at in range(1, store.writes):
        for written in (False, True):
            hit = KillingStore()
            hit.arm(kill_at, written=written)
            assert live(make(), hit) is None
            hit.arm(0, written=False)
            assert live(make(), hit) == outcome, (kill_at, written)
