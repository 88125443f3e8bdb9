"""A state is told once to stop, however many ask; what it does then is not disturbed."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

import smachpy
from smachpy import Concurrence, State, StateMachine
from smachpy.events import Abandoned, Left, PreemptRequested
from smachpy.states import Wait

ENDS = ["done", "parked", "aborted", "preempted"]


class Brakes(State):
    """Stands only if the second that its clean-up takes is not cut short."""

    def __init__(self, **options):
        super().__init__(ENDS, preempt_timeout=30.0, **options)
        self.stands = 0

    def execute(self, userdata):
        self.sleep(60.0)
        self.clock().sleep(1.0)
        self.stands += 1
        return "parked"

    async def brake(self):
        await asyncio.sleep(1.0)
        self.stands += 1


class InFinally(Brakes):
    async def execute(self, userdata):
        try:
            await asyncio.sleep(60.0)
        finally:
            await self.brake()
        return "done"


class InExcept(Brakes):
    async def execute(self, userdata):
        try:
            await asyncio.sleep(60.0)
        except asyncio.CancelledError:
            self.service_preempt()
            async with asyncio.timeout(5.0), asyncio.TaskGroup() as group:
                group.create_task(self.brake())
            return "parked"
        return "done"


def within(state, **options):
    sm = StateMachine(ENDS, name="M", **options)
    sm.add("DRIVE", state)
    return sm


def twice(clock, kind):
    state = kind()
    sm = within(state)
    for at in (5.0, 5.2, 5.4):
        clock.call_later(at, sm.request_preempt)
    return state, sm


def its_timeout_then_the_run(clock, kind):
    state = kind(timeout=5.0)
    sm = within(state)
    clock.call_later(5.2, sm.request_preempt)
    return state, sm


def two_timeouts(_clock, kind):
    state = kind(timeout=5.2)
    return state, within(within(state, timeout=5.4), timeout=5.0)


def operator_then_timeout(clock, kind):
    state = kind(timeout=5.2)
    sm = within(state)
    clock.call_later(5.0, lambda: sm.control.preempt("/M/DRIVE"))
    return state, sm


def siblings(_clock, kind):
    """Each end asks all others again."""
    state = kind()
    both = Concurrence(ENDS, "done", child_termination_cb=lambda _: True)
    both.add("DRIVE", state)
    both.add("WATCH", Wait(5.0))
    both.add("SLOW", Slow())
    return state, within(both)


class Slow(State):
    def __init__(self):
        super().__init__(ENDS)

    def execute(self, userdata):
        self.wait_preempt()
        self.clock().sleep(0.5)
        return "preempted"


@pytest.mark.parametrize("kind", [Brakes, InFinally, InExcept])
@pytest.mark.parametrize(
    "asks", [twice, its_timeout_then_the_run, two_timeouts, operator_then_timeout, siblings]
)
def test_a_later_request_leaves_the_clean_up_alone(clock, asks, kind):
    state, sm = asks(clock, kind)
    sm.execute()
    assert state.stands == 1
    assert clock.now() == 6.0


def test_the_end_of_the_grace_ends_an_async_clean_up(clock):
    state = InFinally()
    smachpy.set_options(state, preempt_timeout=0.5)
    sm = within(state)
    clock.call_later(5.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert state.stands == 0


def test_each_attempt_of_an_async_state_is_cancelled_anew(clock):
    state = InFinally(timeout=5.0, retry=3)
    assert within(state).execute() == "aborted"
    assert state.stands == 3
    assert clock.now() == 18.0


class Recalls(State):
    def __init__(self, times=1):
        super().__init__(["done", "preempted"], preempt_timeout=1.0)
        self.times = times

    def execute(self, userdata):
        for _ in range(self.times):
            self.wait_preempt()
            self.clock().sleep(0.75)
            self.recall_preempt()
        return "preempted" if self.sleep(30.0) else "done"


def test_a_state_that_withdraws_a_request_is_not_interrupted(clock):
    sm = within(Recalls())
    story = []
    sm.subscribe(story.append)
    clock.call_later(1.0, lambda: sm.control.preempt("/M/DRIVE"))
    assert sm.execute() == "done"
    assert not any(isinstance(event, Abandoned) for event in story)
    assert clock.now() == 31.75


def test_a_request_after_a_withdrawn_one_starts_a_grace_of_its_own(clock):
    class Ignores(Recalls):
        def execute(self, userdata):
            super().execute(userdata)
            self.clock().sleep(60.0)
            return "done"

    sm = within(Ignores())
    sm.control  # from the start
    for at in (1.0, 5.0):
        clock.call_later(at, lambda: sm.control.preempt("/M/DRIVE"))
    assert sm.execute() == "preempted"
    assert clock.now() == 6.0


def test_an_async_state_may_withdraw_a_request(clock):
    class Goes(State):
        def __init__(self):
            super().__init__(["done", "preempted"], preempt_timeout=1.0)

        async def execute(self, userdata):
            try:
                await asyncio.sleep(60.0)
            except asyncio.CancelledError:
                self.recall_preempt()
                asyncio.current_task().uncancel()
            await asyncio.sleep(60.0)
            return "done"

    for asks, outcome, ends in (([1.0], "done", 61.0), ([1.0, 9.0], "preempted", 9.0)):
        begin = clock.now()
        sm = within(Goes())
        sm.control  # from the start
        for at in asks:
            clock.call_later(at, lambda sm=sm: sm.control.preempt("/M/DRIVE"))
        assert sm.execute() == outcome
        assert clock.now() - begin == ends


def tidies_up():
    inner = StateMachine(ENDS)
    inner.add("DRIVE", Wait(60.0), {"preempted": "PARK"})
    inner.add("PARK", Wait(3.0), {"done": "parked"})
    return inner


@pytest.mark.parametrize("error", [False, True], ids=["ends", "raises"])
def test_a_sibling_that_ends_later_does_not_stop_the_tidy_up(clock, error):
    class Last(Slow):
        def execute(self, userdata):
            outcome = super().execute(userdata)
            if error:
                raise OSError("broken")
            return outcome

    both = Concurrence(
        ENDS,
        "aborted",
        outcome_map={"parked": {"M": "parked"}},
        child_termination_cb=lambda _: True,
    )
    both.add("M", tidies_up())
    both.add("WATCH", Wait(5.0))
    both.add("LAST", Last())
    ends = []
    both.subscribe(lambda e: ends.append((e.path, e.outcome)) if isinstance(e, Left) else None)
    with pytest.raises(smachpy.InvalidUserCodeError) if error else contextlib.nullcontext():
        assert both.execute() == "parked"
    assert ("/SM_ROOT/M", "parked") in ends
    assert clock.now() == 8.0


def test_an_operator_may_stop_the_tidy_up_that_a_concurrence_began(clock):
    both = Concurrence(ENDS, "aborted", child_termination_cb=lambda _: True, name="C")
    both.add("M", tidies_up())
    both.add("WATCH", Wait(5.0))
    clock.call_later(6.0, lambda: both.control.preempt("/C/M"))
    both.execute()
    assert clock.now() == 6.0


def test_a_listener_that_asks_again_at_each_request_comes_to_an_end(clock):
    """Its own request was published to it, so that it asked again until the stack was full."""
    machine = within(Wait(60.0))
    seen = []

    def ask_again(event):
        if isinstance(event, PreemptRequested):
            seen.append(event.path)
            machine.request_preempt()

    machine.subscribe(ask_again)
    clock.call_later(1.0, machine.request_preempt)
    assert machine.execute() == "preempted"
    assert seen == ["/M", "/M/DRIVE"]
