"""What a run has made is freed as it ends, without the garbage collector."""

from __future__ import annotations

import contextlib
import gc
import time
import weakref

import pytest

from actionlib_core.clock import RealClock, VirtualClock, use_clock
from smachpy import Concurrence, Iterator, State, StateMachine
from smachpy.engine import callback, frame, preempt, step, threads


class Value:
    """Something in userdata."""


class Work(State):
    def __init__(self, *, waits=False, **options):
        super().__init__(["done", "preempted"], output_keys=["made"], **options)
        self.waits = waits
        self.made = []

    def execute(self, userdata):
        value = userdata.made = Value()
        self.made.append(weakref.ref(value))
        return "preempted" if self.waits and self.sleep(60.0) else "done"


def both_of(*states, **options):
    made = Concurrence(["done", "preempted"], "done", **options)
    for number, state in enumerate(states):
        made.add(f"S{number}", state)
    return made


def machine_of(*states):
    made = StateMachine(["done", "preempted"])
    for number, state in enumerate(states):
        last = number == len(states) - 1
        made.add(f"S{number}", state, {"done": "done" if last else f"S{number + 1}"})
    return made


def iterator_of(state):
    made = Iterator(["done", "preempted"], [], [], it=range(3), exhausted_outcome="done")
    made.set_contained_state("S0", state, loop_outcomes=["done"])
    return made


MACHINES = {
    "concurrence": lambda: both_of(Work(), Work()),
    "concurrence that stops its children": lambda: both_of(
        Work(), Work(waits=True), child_termination_cb=lambda _: True
    ),
    "concurrences in each other": lambda: both_of(both_of(Work(), Work()), machine_of(Work())),
    "machine with a concurrence": lambda: machine_of(Work(), both_of(Work(), Work()), Work()),
    "iterator": lambda: iterator_of(both_of(Work(), Work())),
    "options": lambda: both_of(
        Work(timeout=60.0, retry=2), Work(waits=True, timeout=0.01, timeout_outcome="done")
    ),
}

# What is made for one run, and nobody needs after it.
OF_A_RUN = (
    threads.Branch,
    threads.Group,
    callback.CallbackFrame,
    frame.Frame,
    frame.Run,
    frame.Scope,
    preempt.Visit,
    step.Timeout,
)


@pytest.fixture
def no_collector():
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def of_a_run():
    return [one for one in gc.get_objects() if isinstance(one, OF_A_RUN)]


def new(before):
    known = {id(one) for one in before}
    return [type(one).__name__ for one in of_a_run() if id(one) not in known]


@pytest.mark.slow
@pytest.mark.parametrize("watched", [False, True])
@pytest.mark.parametrize("kind_of_clock", ["real", "virtual"])
@pytest.mark.parametrize("kind", MACHINES)
def test_the_objects_of_a_run_are_freed_as_it_ends(kind, kind_of_clock, watched, no_collector):
    machine = MACHINES[kind]()
    machine.register_start_cb(lambda *_: None)
    before = of_a_run()
    with clock_of(kind_of_clock) as clock, use_clock(clock):
        if watched:
            machine.subscribe(lambda event: None)
        for _ in range(5):
            assert machine.execute() == "done"
        # A machine that is watched keeps the frames of its newest run; five runs made dozens.
        kept = {"Frame", "Root", "Run", "ChildBranch"} if watched else set()
        deadline = time.monotonic() + 60.0
        while not set(left := new(before)) <= kept or len(left) > 5:
            assert time.monotonic() < deadline, left
            clock.sleep(0.02)  # the threads of the last children are putting themselves away
        machine.reset_userdata()
        made = [ref for state in states_of(machine) for ref in state.made]
        assert made
        assert [ref() for ref in made] == [None] * len(made)


@contextlib.contextmanager
def clock_of(kind):
    if kind == "real":
        yield RealClock()
        return
    with VirtualClock() as clock:
        yield clock


def states_of(machine):
    for state in machine.get_children().values():
        if isinstance(state, Work):
            yield state
        else:
            yield from states_of(state)
