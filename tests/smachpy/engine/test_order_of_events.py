"""Events are published in their order, and before `execute` returns, whichever thread does it."""

from __future__ import annotations

import contextlib
from collections import deque

import pytest

from smachpy import Concurrence, State, StateMachine
from smachpy.engine.frame import Run
from smachpy.events import Abandoned, Finished, Left, PreemptRequested


class Deaf(State):
    def __init__(self):
        super().__init__(["ok", "preempted"], preempt_timeout=0.5)

    def execute(self, userdata):
        for _ in range(40):
            with contextlib.suppress(BaseException):  # nothing gets through to it
                self.clock().sleep(0.5)
        return "ok"


def machine(kind):
    sm = StateMachine(["ok", "preempted"], name="M")
    if kind == "branch":
        both = Concurrence(["ok", "preempted"], "ok")
        both.add("S", Deaf())
        both.add("T", Deaf())
        sm.add("BOTH", both)
    else:
        sm.add("S", Deaf())
    return sm


@pytest.mark.parametrize("slow", [0.0, 0.25])
@pytest.mark.parametrize("kind", ["leaf", "branch"])
def test_what_is_told_of_a_state_that_is_left_behind_is_told_before_the_end(clock, kind, slow):
    """A recording showed a run that never ended."""
    heard = []

    def listen(event):
        if isinstance(event, Abandoned):
            clock.sleep(slow)  # the others wait for their turn
        heard.append(event)

    for _ in range(10):
        heard.clear()
        sm = machine(kind)
        forget = sm.subscribe(listen)
        clock.call_later(1.0, sm.request_preempt)
        outcomes = []
        runner = clock.spawn(lambda sm=sm, into=outcomes: into.append(sm.execute()), name="runner")
        runner.join()
        forget()
        kinds = [type(event) for event in heard]
        assert outcomes == ["preempted"]
        assert kinds[-1] is Finished
        assert kinds.count(Left) == (3 if kind == "branch" else 1)
        assert [e.t for e in heard] == sorted(e.t for e in heard)
        for path in {event.path for event in heard if isinstance(event, Abandoned)}:
            own = [type(event) for event in heard if event.path == path]
            assert own.index(Abandoned) < own.index(Left)
        clock.sleep(60.0)  # the threads that were left behind end
        assert len(heard) == len(kinds)


def test_a_listener_that_blocks_keeps_nobody_but_the_order(clock):
    sm = machine("leaf")
    heard, gate = [], clock.event("never set")

    def listen(event):
        heard.append(type(event))
        if isinstance(event, Abandoned):
            gate.wait(500.0)

    sm.subscribe(listen)
    clock.call_later(1.0, sm.request_preempt)
    runner = clock.spawn(sm.execute, name="runner")
    assert runner.join(60.0)
    clock.sleep(600.0)
    assert {Left, Finished} <= set(heard)


def test_a_request_waits_for_no_listener_of_another_thread(clock):
    sm = StateMachine(["ok", "preempted"], name="M")
    sm.add("S", Deaf())
    took = []

    def ask():
        begin = clock.now()
        sm.request_preempt()
        took.append(clock.now() - begin)

    def listen(event):
        if isinstance(event, PreemptRequested) and len(took) == 0:
            clock.sleep(5.0)

    sm.subscribe(listen)
    clock.spawn(ask, name="first")
    clock.call_later(1.0, lambda: clock.spawn(ask, name="second"))
    clock.spawn(sm.execute, name="runner").join()
    clock.sleep(60.0)
    assert min(took) == 0.0


class Growing(deque):
    """Another thread appends between any two looks at the items."""

    def __iter__(self):
        for item in super().__iter__():
            yield item
            self.append(int)


def test_events_are_told_while_other_threads_add_to_them():
    """The thread that told them ended: deque mutated during iteration."""
    run = Run(None)
    run.pending = Growing()
    told = []

    def first():
        told.append("first")
        run.flush()  # as a listener does that publishes: the first one is still being told

    run.pending.extend([first, lambda: told.append("second")])
    run.flush()
    assert told == ["first", "second"]
    assert not run.pending
