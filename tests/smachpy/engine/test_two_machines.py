"""Two machines of one program that run at the same time: a stop reaches the one that it is for."""

from __future__ import annotations

import copy

import pytest

import smachpy
from actionlib_core.clock import current_clock
from smachpy import CBState, Concurrence, InvalidStateError, State, StateMachine
from smachpy.events import Finished, Started

ENDS = ["done", "preempted"]


def nap(_userdata):
    return "preempted" if smachpy.current_state().sleep(10.0) else "done"


@smachpy.state(outcomes=ENDS)
def charge(_userdata):
    return nap(_userdata)


@smachpy.state(outcomes=ENDS)
async def charge_async(_userdata):
    import asyncio

    await asyncio.sleep(10.0)
    return "done"


class Nap(State):
    def __init__(self):
        super().__init__(ENDS)

    def execute(self, userdata):
        return nap(userdata)


def machine(name, state, *, nested):
    sm = StateMachine(ENDS, name=name)
    inner = StateMachine(ENDS)
    inner.add("NAP", state)
    sm.add("IN", inner if nested else state)
    return sm


def run_both(clock, first, second, at=2.0):
    """Run both, the second one a second later; return their outcomes, or errors."""
    ends = {}

    def run(sm):
        try:
            ends[sm.name] = sm.execute()
        except smachpy.SmachError as error:
            ends[sm.name] = error

    tasks = [clock.spawn(lambda: run(first), name="first")]
    clock.sleep(1.0)
    tasks.append(clock.spawn(lambda: run(second), name="second"))
    clock.sleep(at - 1.0)
    first.request_preempt()
    for task in tasks:
        task.join()
    return ends


@pytest.mark.parametrize("nested", [False, True])
@pytest.mark.parametrize(
    "state", [charge, charge_async, CBState(nap, outcomes=ENDS)], ids=["plain", "async", "callback"]
)
def test_functions_may_be_states_of_several_machines(clock, state, nested):
    """The stop of one robot stopped the other, and the first drove on."""
    first, second = (machine(name, state, nested=nested) for name in "AB")
    assert run_both(clock, first, second) == {"A": "preempted", "B": "done"}
    assert run_both(clock, second, first) == {"B": "preempted", "A": "done"}
    smachpy.set_options(state, timeout=3.0, timeout_outcome="done")  # holds for both
    begin = clock.now()
    assert first.execute() == "done"
    assert clock.now() - begin == 3.0
    smachpy.set_options(state, timeout=None)


@pytest.mark.parametrize("nested", [False, True])
def test_an_instance_with_attributes_belongs_to_one_running_machine(clock, nested):
    state = Nap()
    first, second = (machine(name, state, nested=nested) for name in "AB")
    where = "/B/IN/NAP" if nested else "/B/IN"
    ends = run_both(clock, first, second)
    assert ends["A"] == "preempted"
    assert str(ends["B"]).startswith(f"{where}: state: got the Nap that the running machine '/A'")
    assert second.execute() == "done"  # one after the other is fine
    assert first.execute() == "done"


@pytest.mark.parametrize("state", [charge, CBState(nap, outcomes=ENDS)], ids=["plain", "callback"])
def test_a_copy_of_a_function_state_is_one_as_well(clock, state):
    """A copied machine was refused beside another that had its states."""
    first = machine("A", copy.copy(state), nested=False)
    second = machine("B", first.get_children()["IN"], nested=True)
    assert run_both(clock, first, second) == {"A": "preempted", "B": "done"}


def brakes(_userdata):
    if smachpy.current_state().sleep(10.0):
        current_clock().sleep(5.0)
        return "preempted"
    return "done"


def running_copies():
    state = smachpy.state(outcomes=ENDS)(brakes)
    return machine("A", state, nested=True), lambda _: machine("B", state, nested=True)


def deep_copies():
    return machine("A", CBState(brakes, outcomes=ENDS), nested=True), copy.deepcopy


@pytest.mark.parametrize("make", [running_copies, deep_copies])
@pytest.mark.parametrize("asked", [2.0, None], ids=["running", "before its run"])
def test_a_copy_of_what_was_asked_to_stop_is_not_asked(clock, make, asked):
    """The flag was copied, so the other machine ended at once, although nobody had asked it."""
    first, other = make()
    if asked is None:
        first.request_preempt()
    else:
        clock.call_later(asked, first.request_preempt)
        task = clock.spawn(first.execute, name="first")
        clock.sleep(asked + 1.0)
    second = other(first)
    assert second.execute() == "done"
    if asked is not None:
        task.join()


def test_two_machines_that_share_nothing_run_as_ever(clock):
    first, second = (machine(name, Nap(), nested=False) for name in "AB")
    assert run_both(clock, first, second) == {"A": "preempted", "B": "done"}


def test_a_second_run_is_refused_as_soon_as_the_first_was_called(clock):
    """It began while the start of the first one was told, and the end of that took its request."""
    sm = machine("A", Nap(), nested=False)
    sm.subscribe(lambda event: clock.sleep(3.0) if isinstance(event, Started) else None)
    outcomes = []
    first = clock.spawn(lambda: outcomes.append(sm.execute()), name="first")
    clock.sleep(1.0)
    with pytest.raises(InvalidStateError, match="second call while it runs"):
        sm.execute()
    sm.request_preempt()
    first.join()
    assert outcomes == ["preempted"]
    assert clock.now() == 3.0


def test_the_end_of_a_run_takes_no_request_from_the_next_one(clock):
    """The next one begins as soon as the end is told, which the listeners hear one by one."""
    sm = machine("A", Nap(), nested=False)
    smachpy.set_options(sm, on_enter=lambda _: clock.sleep(1.0))
    unsubscribe = sm.subscribe(
        lambda event: clock.sleep(1.0) if isinstance(event, Finished) else None
    )
    outcomes = []
    first = clock.spawn(lambda: outcomes.append(sm.execute()), name="first")
    clock.sleep(11.25)  # on_enter, the nap, and a part of the listener
    unsubscribe()
    second = clock.spawn(lambda: outcomes.append(sm.execute()), name="second")
    clock.call_later(0.5, sm.request_preempt)  # before the first call has returned
    for task in (first, second):
        task.join()
    assert outcomes == ["done", "preempted"]
    assert clock.now() < 14.0


def test_branches_of_one_machine_that_share_a_function_are_refused_still():
    both = Concurrence(ENDS, "done")
    both.add("A", charge)
    with pytest.raises(smachpy.InvalidStateError, match="of its own"):
        both.add("B", charge)
