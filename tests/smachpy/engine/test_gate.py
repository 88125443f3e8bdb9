"""Whatever starts while an operator has paused the machine waits for the resume."""

from __future__ import annotations

import asyncio
import contextlib

import pytest

import smachpy
from actionlib_core.interfaces.actionlib.msg import TestAction
from smachpy.events import Paused, Resumed
from smachpy.testing import mission_kit
from tests.smachpy.pnp.nets import net_of


class Flaky(smachpy.State):
    """Fails after a second, for the first `times`; notes when it began."""

    def __init__(self, begins, result="aborted", times=1, **options):
        super().__init__(["succeeded", "aborted", "preempted"], **options)
        self.begins, self.result, self.times = begins, result, times

    def execute(self, userdata):
        self.begins.append(self.clock().now())
        if self.sleep(1.0):
            return "preempted"
        if len(self.begins) > self.times:
            return "succeeded"
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


class FlakyAsync(Flaky):
    async def execute(self, userdata):
        return super().execute(userdata)


ENDS = ["succeeded", "aborted", "preempted"]


def machine(state, **options):
    sm = smachpy.StateMachine(ENDS, name="M", **options)
    sm.add("A", state)
    return sm


def concurrence(state):
    both = smachpy.Concurrence(ENDS, "aborted", outcome_map={"succeeded": {"A": "succeeded"}})
    both.add("A", state)
    return both


def iterator(state):
    each = smachpy.Iterator(ENDS, [], [], it=[1], exhausted_outcome="succeeded")
    each.set_contained_state("A", state, ["succeeded"], ["aborted", "preempted"])
    return each


def plan(state):
    net = net_of("init* -> A.exec : A.start\nA.exec -> goal : A.end")
    return smachpy.pnp.PetriNetPlan(net, {"A": state})


RETRY = (3, 4.0, ["aborted", OSError])
SHAPES = {
    "leaf": lambda begins: machine(Flaky(begins, retry=RETRY)),
    "exception": lambda begins: machine(Flaky(begins, OSError("busy"), retry=RETRY)),
    "async": lambda begins: machine(FlakyAsync(begins, retry=RETRY)),
    "timeout": lambda begins: machine(Flaky(begins, retry=RETRY, timeout=0.75)),
    "container": lambda begins: machine(machine(Flaky(begins), retry=RETRY)),
    "root": lambda begins: machine(Flaky(begins), retry=RETRY),
    "branch": lambda begins: machine(concurrence(Flaky(begins, retry=RETRY))),
    "item": lambda begins: machine(iterator(Flaky(begins, retry=RETRY))),
    "plan": lambda begins: plan(Flaky(begins, retry=RETRY)),
}


@pytest.mark.parametrize("at", [0.5, 2.0], ids=["in the attempt", "before the next"])
@pytest.mark.parametrize("shape", SHAPES)
def test_the_next_attempt_waits_for_the_resume(clock, shape, at):
    """A paused machine began it, and the robot drove."""
    begins, story = [], []
    sm = SHAPES[shape](begins)
    sm.subscribe(story.append)
    clock.call_later(at, sm.control.pause)
    clock.call_later(60.0, sm.control.resume)
    assert sm.execute() in {"succeeded", "aborted", "goal"}  # the timeout's attempts all fail
    assert [begin < at or begin >= 60.0 for begin in begins] == [True] * len(begins)
    assert begins[1] == 60.0
    assert [type(e) for e in story if isinstance(e, (Paused, Resumed))] == [Paused, Resumed]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_stop_of_what_waits_for_its_next_attempt_does_not_begin_it(clock, shape):
    begins = []
    sm = SHAPES[shape](begins)
    clock.call_later(0.5, sm.control.pause)
    clock.call_later(60.0, sm.request_preempt)
    assert sm.execute() == "preempted"
    assert begins == [0.0]
    assert clock.now() == 60.0


def test_a_step_lets_one_attempt_run(clock):
    begins = []
    sm = machine(Flaky(begins, times=2, retry=(3, 0.0)))
    sm.control.pause()
    for at in (10.0, 20.0, 30.0):
        clock.call_later(at, sm.control.step)
    assert sm.execute() == "succeeded"
    assert begins == [10.0, 20.0, 30.0]


def test_a_goal_that_is_tried_again_is_not_sent_while_paused():
    with mission_kit() as kit:
        robot = kit.action_server("drive", TestAction)
        robot.reply(status="aborted", duration=1.0)
        robot.reply(duration=2.0)
        sm = machine(smachpy.SimpleActionState("drive", TestAction, retry=(3, 20.0, "aborted")))
        sent = []
        sm.subscribe(
            lambda e: sent.append(sm.control.is_paused()) if type(e).__name__ == "GoalSent" else 0
        )
        kit.clock.call_later(5.0, sm.control.pause)
        kit.clock.call_later(95.0, sm.control.resume)
        assert kit(sm).outcome == "succeeded"
    assert sent == [False, False]


class Finishes(smachpy.State):
    """Has finished its work in the moment in which it is asked to stop."""

    def __init__(self, begins):
        super().__init__(ENDS)
        self.begins = begins

    def execute(self, userdata):
        self.begins.append(self.clock().now())
        self.wait_preempt(2.0)
        return "succeeded"


class FinishesAsync(Finishes):
    async def execute(self, userdata):
        self.begins.append(self.clock().now())
        with contextlib.suppress(asyncio.CancelledError):
            await asyncio.sleep(2.0)
        return "succeeded"


AROUND = {
    "machine": machine,
    "nested": lambda state: machine(machine(state)),
    "concurrence": concurrence,
    "iterator": iterator,
    "plan": plan,
}


@pytest.mark.parametrize("kind", [Finishes, FinishesAsync])
@pytest.mark.parametrize("around", AROUND)
def test_work_that_is_finished_when_a_pause_cancels_it_is_not_done_again(clock, kind, around):
    """The parcel was put down twice."""
    begins = []
    sm = AROUND[around](kind(begins))
    clock.call_later(1.0, lambda: sm.control.pause(running="cancel"))
    clock.call_later(60.0, sm.control.resume)
    assert sm.execute() == ("goal" if around == "plan" else "succeeded")
    assert begins == [0.0]


@pytest.mark.parametrize("around", AROUND)
def test_a_goal_that_the_cancel_of_a_pause_did_not_reach_is_not_sent_again(around):
    with mission_kit() as kit:
        robot = kit.action_server("place", TestAction)
        robot.ignore_cancel(2.0)
        robot.default_result(duration=2.0)
        sm = AROUND[around](smachpy.SimpleActionState("place", TestAction))
        kit.clock.call_later(1.0, lambda: sm.control.pause(running="cancel"))
        kit.clock.call_later(60.0, sm.control.resume)
        assert kit(sm).outcome == ("goal" if around == "plan" else "succeeded")
        assert len(robot.goals) == 1


@pytest.mark.parametrize("around", AROUND)
def test_an_attempt_that_fails_as_a_pause_cancels_it_is_repeated_after_the_resume(clock, around):
    class FailsAtOnce(Flaky):
        def execute(self, userdata):
            self.begins.append(self.clock().now())
            return "aborted" if self.sleep(2.0) else "succeeded"

    begins = []
    sm = AROUND[around](FailsAtOnce(begins, retry=(3, 0.0, "aborted")))
    clock.call_later(1.0, lambda: sm.control.pause(running="cancel"))
    clock.call_later(60.0, sm.control.resume)
    assert sm.execute() == ("goal" if around == "plan" else "succeeded")
    assert begins == [0.0, 60.0]


class Works(smachpy.State):
    def __init__(self, **options):
        super().__init__(ENDS, **options)

    def execute(self, userdata):
        return "preempted" if self.sleep(10.0) else "succeeded"


def two_in(kind, **options):
    """A container with a timeout that two states of ten seconds, one after the other, need."""
    inner = smachpy.StateMachine(ENDS, **({} if kind == "branch" else options), name="M")
    inner.add("A", Works(), {"succeeded": "B"})
    inner.add("B", Works())
    if kind == "root":
        return inner
    if kind == "branch":
        both = smachpy.Concurrence(
            ENDS, "aborted", outcome_map={"succeeded": {"A": "succeeded"}}, **options
        )
        both.add("A", inner)
        return machine(both)
    return machine(iterator(inner) if kind == "item" else machine(inner))


@pytest.mark.parametrize("how", ["keep", "cancel"])
@pytest.mark.parametrize("kind", ["root", "nested", "branch", "item"])
def test_the_timeout_of_a_container_stands_still_while_an_operator_holds_it(clock, kind, how):
    sm = two_in(kind, timeout=28.0)
    clock.call_later(5.0, lambda: sm.control.pause(running=how))
    clock.call_later(3600.0, sm.control.resume)
    assert sm.execute() == "succeeded"
    assert clock.now() == (3610.0 if how == "keep" else 3620.0)


@pytest.mark.parametrize("kind", ["root", "nested", "branch", "item"])
def test_the_time_that_was_left_before_a_pause_is_left_after_it(clock, kind):
    sm = two_in(kind, timeout=15.0)
    for at in (2.0, 200.0, 300.0):
        clock.call_later(at, sm.control.pause)
    for at in (100.0, 250.0, 400.0):
        clock.call_later(at, sm.control.resume)
    assert sm.execute() == "aborted"
    assert clock.now() == 105.0  # ten seconds of A, and five of B


def test_what_runs_on_in_a_pause_keeps_its_own_timeout(clock):
    sm = machine(Works(timeout=8.0))
    clock.call_later(5.0, sm.control.pause)
    assert sm.execute() == "aborted"
    assert clock.now() == 8.0
