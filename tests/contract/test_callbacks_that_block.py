"""Nothing that a user's callback does delays a cancel, a deadline or the end of a goal."""

from __future__ import annotations

import logging

import pytest

from actionlib_core.action._callbacks import HELPERS, CallbackQueue
from actionlib_core.action.client import ActionClient, CommState
from actionlib_core.action.goal_manager import CALLBACKS_S
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock
from actionlib_core.goal.bounded import Backlog
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestFeedback as Feedback
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.node import Node
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import SimpleActionState, StateMachine, events
from smachpy.actions.goal_run import STOPPED_S
from smachpy.actions.simple_action_state import MARGIN_S
from tests.two_nodes import TwoNodes

LONG_S = 60.0
BLOCKED_S = 1000.0
HEARD_S = 0.05  # a cancel is heard by the server so soon after the request


class World(TwoNodes):
    """A server that gives feedback every 50 ms until it is asked to stop, in virtual time."""

    def __init__(self):
        super().__init__()
        self.heard = []
        self.server = SimpleActionServer("do", Action, self.drive, False, node=self.robot)
        self.server.start()

    def drive(self, goal):
        for number in range(goal.goal * 20):
            self.server.publish_feedback(Feedback(number))
            if self.server.wait_preempt(0.05):
                self.heard.append(self.clock.now())
                self.server.set_preempted(Result(number))
                return
        self.server.set_succeeded(Result(goal.goal))

    def block(self, *_):
        """Return late, as a callback does that waits for what does not come."""
        self.clock.sleep(BLOCKED_S)

    def run(self, state, preempt_after=None, listener=None):
        """Run a state in a machine; return the outcome and when it was there [s]."""
        machine = StateMachine(["succeeded", "aborted", "preempted"])
        with machine:
            machine.add("A", state)
        if listener is not None:
            machine.subscribe(listener)
        if preempt_after is not None:
            self.clock.call_later(preempt_after, machine.request_preempt)
        began = self.clock.now()
        return machine.execute(), self.clock.now() - began

    def state(self, seconds, **options):
        return SimpleActionState("do", Action, goal=Goal(seconds), node=self.mission, **options)

    def client(self, kind=SimpleActionClient, **options):
        client = kind("do", Action, node=self.mission, **options)
        assert client.wait_for_server(LONG_S)
        return client


@pytest.fixture
def world():
    with World() as world:
        yield world


# -- an action state ---------------------------------------------------------------------------


def test_preempt_cancels_the_goal_while_feedback_cb_blocks(world):
    outcome, _ = world.run(world.state(60, feedback_cb=world.block), preempt_after=1.0)
    assert outcome == "preempted"
    assert world.heard == [pytest.approx(1.0, abs=HEARD_S)]


def test_preempt_cancels_the_goal_while_a_listener_blocks(world):
    def listen(event):
        if isinstance(event, events.GoalSent):
            world.clock.sleep(5.0)

    world.run(world.state(60), preempt_after=1.0, listener=listen)
    assert world.heard == [pytest.approx(1.0, abs=HEARD_S)]


def test_exec_timeout_cancels_the_goal_while_feedback_cb_blocks(world):
    outcome, _ = world.run(world.state(60, feedback_cb=world.block, exec_timeout=2.0))
    assert outcome == "aborted"
    assert world.heard == [pytest.approx(2.0, abs=HEARD_S)]


def test_exec_timeout_counts_from_when_a_server_took_the_goal_whatever_a_listener_does(world):
    def listen(event):
        if isinstance(event, events.GoalSent):
            world.clock.sleep(10.0)

    world.run(world.state(60, exec_timeout=2.0), listener=listen)
    assert world.heard == [pytest.approx(2.0, abs=HEARD_S)]


def test_slow_feedback_cb_delays_neither_preempt_nor_end(world, caplog):
    state = world.state(60, feedback_cb=lambda _, __: world.clock.sleep(0.1))
    outcome, took_s = world.run(state, preempt_after=4.0)
    assert outcome == "preempted"
    assert world.heard == [pytest.approx(4.0, abs=HEARD_S)]
    assert took_s < 4.0 + 0.1 + STOPPED_S + 0.1
    assert "dropped" in caplog.text


def test_goal_that_ended_while_feedback_cb_was_busy_keeps_its_end(world):
    state = world.state(1, feedback_cb=lambda _, __: world.clock.sleep(3.0), exec_timeout=2.0)
    outcome, _ = world.run(state, preempt_after=2.5)
    assert outcome == "succeeded"
    assert not world.heard


CALLBACKS = {
    "feedback_cb": lambda block: {"feedback_cb": block},
    "result_cb": lambda block: {"result_cb": block},
    "feedback_cb after the end": lambda block: {"feedback_cb": block},
}


@pytest.mark.parametrize("callback", CALLBACKS)
def test_a_callback_that_never_returns_ends_by_exec_timeout(world, callback):
    """The goal is cancelled at once; the state ends when the grace of its preempts is over."""
    seconds = 1 if "end" in callback or callback == "result_cb" else 60
    block = CALLBACKS[callback](lambda *_: world.clock.sleep(1e6))
    state = world.state(seconds, exec_timeout=2.0, preempt_timeout=3.0, **block)
    heard = []
    outcome, took_s = world.run(state, listener=heard.append)
    assert outcome == "aborted"
    assert took_s == pytest.approx(2.0 + 3.0 + MARGIN_S, abs=0.3)
    assert world.heard == ([pytest.approx(2.0, abs=HEARD_S)] if seconds == 60 else [])
    assert not state.preempt_requested()
    done = [e for e in heard if isinstance(e, events.GoalDone)]
    assert len(done) == 1
    assert sum(isinstance(e, events.Abandoned) for e in heard) == 1
    world.heard.clear()
    again, _ = world.run(world.state(1))
    assert again == "succeeded"


@pytest.mark.parametrize("callback", ["feedback_cb", "result_cb"])
def test_a_callback_that_takes_longer_than_exec_timeout_but_returns_is_not_cut(world, callback):
    called = []

    def slow(*_):
        if not called:
            world.clock.sleep(3.0)
        called.append(1)

    state = world.state(1, exec_timeout=2.0, preempt_timeout=3.0, **{callback: slow})
    heard = []
    outcome, _ = world.run(state, listener=heard.append)
    assert outcome == "succeeded"
    assert called
    assert not any(isinstance(e, events.Abandoned) for e in heard)
    assert not state.preempt_requested()


def test_a_preempt_after_exec_timeout_is_one_of_the_machine(world):
    """A callback that does not return neither hides the preempt nor turns it into 'aborted'."""
    state = world.state(
        60, exec_timeout=2.0, preempt_timeout=3.0, feedback_cb=lambda *_: world.clock.sleep(1e6)
    )
    outcome, took_s = world.run(state, preempt_after=4.0)
    assert outcome == "preempted"
    assert took_s == pytest.approx(2.0 + 3.0 + MARGIN_S, abs=0.3)


# -- clients -----------------------------------------------------------------------------------


@pytest.mark.parametrize("blocking", ["active_cb", "feedback_cb"])
def test_blocking_callback_delays_neither_cancel_nor_end_of_a_simple_client(world, blocking):
    client = world.client()
    done = []
    client.send_goal(Goal(60), lambda *args: done.append(args), **{blocking: world.block})
    world.clock.sleep(1.0)
    client.cancel_goal()
    began = world.clock.now()
    assert client.wait_for_result(LONG_S)
    assert world.clock.now() - began <= HEARD_S + CALLBACKS_S
    assert world.heard == [pytest.approx(1.0, abs=HEARD_S)]
    assert client.get_state() == GoalStatus.PREEMPTED
    assert not done  # it comes after the others, in order
    world.clock.sleep(BLOCKED_S)
    assert [status for status, _ in done] == [GoalStatus.PREEMPTED]


def test_goal_that_is_over_is_told_as_such_though_done_cb_blocks(world):
    client = world.client()
    client.send_goal(Goal(1), world.block)
    assert client.wait_for_result(5.0)
    assert client.get_state() == GoalStatus.SUCCEEDED
    assert world.clock.now() <= 5.0 + HEARD_S


def test_wait_lasts_until_done_cb_has_returned(world):
    client = world.client()
    done = []
    client.send_goal(Goal(1), lambda *_: (world.clock.sleep(7.0), done.append(world.clock.now())))
    assert client.wait_for_result()
    assert len(done) == 1


def test_callback_of_a_former_goal_delays_nothing_of_the_next(world):
    client = world.client()
    client.send_goal(Goal(1), world.block)
    world.clock.sleep(2.0)
    client.send_goal(Goal(1), lambda *_: None)
    began = world.clock.now()
    assert client.wait_for_result(LONG_S)
    assert world.clock.now() - began <= 1.0 + CALLBACKS_S + HEARD_S
    client.send_goal(Goal(60), feedback_cb=lambda _: None)
    world.clock.sleep(1.0)
    began = world.clock.now()
    client.cancel_goal()
    assert client.wait_for_result(LONG_S)
    assert world.heard == [pytest.approx(began, abs=HEARD_S)]


def test_transition_callback_that_blocks_delays_no_other_goal(world):
    client = world.client(ActionClient)
    first = client.send_goal(Goal(1), world.block)
    assert first.wait(LONG_S)
    second = client.send_goal(Goal(60), lambda _: None)
    world.clock.sleep(1.0)
    began = world.clock.now()
    second.cancel()
    assert second.wait(LONG_S)
    assert world.heard == [pytest.approx(began, abs=HEARD_S)]
    assert second.get_comm_state() is CommState.DONE


def test_forgotten_goal_ends_the_wait_for_it(world):
    client = world.client()
    client.send_goal(Goal(60), lambda *_: None)
    world.clock.call_later(1.0, client.stop_tracking_goal)
    assert not client.wait_for_result(LONG_S)
    assert world.clock.now() < 2.0


@pytest.mark.parametrize("busy_s", [0.01, 0.3])
def test_feedback_is_delivered_after_the_end_while_its_callback_makes_progress(
    world, caplog, busy_s
):
    client, seen = world.client(), []
    done = world.clock.event()

    def on_feedback(feedback):
        world.clock.sleep(busy_s)
        seen.append(feedback.feedback)

    client.send_goal(Goal(1), lambda *_: done.set(), feedback_cb=on_feedback)
    assert done.wait(LONG_S)
    assert seen == list(range(20))
    assert client.dropped_feedback == 0
    assert "dropped" not in caplog.text


def test_state_gets_the_feedback_that_waits_at_the_end_of_its_goal(world, caplog):
    seen = []

    def on_feedback(_, feedback):
        world.clock.sleep(0.3)
        seen.append(feedback.feedback)

    outcome, _ = world.run(world.state(1, feedback_cb=on_feedback))
    assert outcome == "succeeded"
    assert seen == list(range(20))
    assert "dropped" not in caplog.text


def test_feedback_that_waits_is_bounded_and_the_drops_are_counted_and_told(
    world, monkeypatch, caplog
):
    monkeypatch.setattr("actionlib_core.action.client_goal_handle.Backlog", lambda: Backlog(3))
    client = world.client()
    seen = []
    client.send_goal(
        Goal(1), feedback_cb=lambda f: (seen.append(f.feedback), world.clock.sleep(0.55))
    )
    assert client.wait_for_result(LONG_S)
    assert client.get_result() == Result(1)
    assert seen == sorted(seen)
    assert seen[-1] >= 16  # the oldest are dropped, not the newest
    assert client.dropped_feedback == 20 - len(seen)
    assert [r.levelno for r in caplog.records if "dropped" in r.getMessage()] == [
        logging.WARNING
    ] * 2


def test_feedback_that_a_loop_leaves_lying_is_counted(world, monkeypatch):
    monkeypatch.setattr("actionlib_core.action.client_goal_handle.Backlog", lambda: Backlog(3))
    client = world.client(ActionClient)
    sent = client.send(Goal(1))
    assert sent.wait(LONG_S)
    assert [feedback.feedback for feedback in sent.feedback()] == [17, 18, 19]
    assert sent.dropped_feedback == 17


# -- servers -----------------------------------------------------------------------------------


def test_cancel_callback_does_not_wait_for_a_goal_callback(world):
    told = []

    def drive(handle):
        handle.set_accepted()
        world.block()

    def stop(handle):
        told.append(world.clock.now())
        handle.set_canceled()

    server = ActionServer("raw", Action, drive, stop, False, node=world.robot)
    server.start()
    client = ActionClient("raw", Action, node=world.mission)
    handle = client.send_goal(Goal(1))
    world.clock.sleep(1.0)
    handle.cancel()
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.PREEMPTED
    assert told == [pytest.approx(1.0, abs=HEARD_S)]


def test_cancel_callbacks_do_not_wait_for_each_other(world):
    told = []

    def stop(handle):
        told.append(world.clock.now())
        world.block()

    server = ActionServer(
        "raw", Action, lambda handle: handle.set_accepted(), stop, False, node=world.robot
    )
    server.start()
    client = ActionClient("raw", Action, node=world.mission)
    handles = [client.send_goal(Goal(1)) for _ in range(5)]
    world.clock.sleep(1.0)
    for handle in handles:
        handle.cancel()
    world.clock.sleep(1.0)
    assert told == [pytest.approx(1.0, abs=HEARD_S)] * 5


def test_cancel_callback_never_comes_before_the_goal_callback(world):
    calls = []

    def take(handle):
        calls.append(("goal", handle.get_goal().goal))
        world.clock.sleep(5.0)

    def stop(handle):
        calls.append(("cancel", handle.get_goal().goal))
        handle.set_canceled()

    server = ActionServer("raw", Action, take, stop, False, node=world.robot)
    server.start()
    client = ActionClient("raw", Action, node=world.mission)
    handles = [client.send_goal(Goal(number)) for number in range(2)]
    world.clock.sleep(1.0)
    handles[1].cancel()
    world.clock.sleep(1.0)
    assert calls == [("goal", 0)]
    assert handles[1].wait(LONG_S)
    assert calls == [("goal", 0), ("goal", 1), ("cancel", 1)]


def test_quick_callbacks_of_a_server_never_overlap(world):
    inside, overlaps = [], []

    def work(_handle):
        overlaps.extend(inside)
        inside.append(1)
        world.clock.sleep(0.001)
        inside.pop()

    server = ActionServer("raw", Action, work, work, False, node=world.robot)
    server.start()
    client = ActionClient("raw", Action, node=world.mission)
    for _ in range(10):
        client.send_goal(Goal(1)).cancel()
        world.clock.sleep(0.01)
    assert not overlaps


def test_preempt_callback_does_not_wait_for_a_goal_callback(world):
    told = []
    server = SimpleActionServer("old", Action, None, False, node=world.robot)

    def drive():
        server.accept_new_goal()
        world.block()

    server.register_goal_callback(drive)
    server.register_preempt_callback(lambda: (told.append(world.clock.now()), world.block()))
    server.start()
    client = SimpleActionClient("old", Action, node=world.mission)
    client.send_goal(Goal(1))
    world.clock.sleep(1.0)
    client.cancel_goal()
    world.clock.sleep(1.0)
    assert told == [pytest.approx(1.0, abs=HEARD_S)]


# -- topics ------------------------------------------------------------------------------------


def test_messages_that_wait_for_a_slow_subscriber_are_bounded(world, monkeypatch, caplog):
    monkeypatch.setattr("actionlib_core.pubsub.topic.MESSAGES", 3)
    seen = []
    subscriber = Subscriber(
        "counter",
        Int32,
        lambda message: (seen.append(message.data), world.clock.sleep(10.0)),
        node=world.mission,
    )
    publisher = Publisher("counter", Int32, node=world.robot)
    assert publisher.wait_for_connections(1, LONG_S)
    for number in range(10):
        publisher.publish(number)
        world.clock.sleep(0.1)
    world.clock.sleep(100.0)
    assert seen == [0, 7, 8, 9]
    assert subscriber.dropped == 6
    assert "dropped" in caplog.text


# -- in real time ------------------------------------------------------------------------------


def test_cancel_is_heard_though_every_callback_of_the_mission_blocks():
    """On the real clock and threads; the figure is measured where nothing else loads the machine."""
    clock = RealClock()
    network = MemoryNetwork(clock)
    heard, release = clock.event(), clock.event()
    with (
        Node("robot", transport=network.session(), clock=clock) as robot,
        Node("mission", transport=network.session(), clock=clock) as mission,
    ):

        def drive(_goal):
            server.publish_feedback(Feedback(1))
            assert server.wait_preempt(LONG_S)
            heard.set()
            server.set_preempted()

        server = SimpleActionServer("do", Action, drive, False, node=robot)
        server.start()
        inside = clock.event()

        def block(*_):
            inside.set()
            release.wait(LONG_S)

        machine = StateMachine(["succeeded", "aborted", "preempted"])
        with machine:
            machine.add("A", SimpleActionState("do", Action, feedback_cb=block, node=mission))
        running = clock.spawn(machine.execute, name="mission")
        assert inside.wait(LONG_S)
        machine.request_preempt()
        assert heard.wait(LONG_S)
        release.set()
        assert running.join(LONG_S)


def test_urgent_callbacks_overtake_as_soon_as_a_thread_can_be_started(world, monkeypatch):
    """A cancel waited for the next one, or for the end of the goal that it was to end."""
    callbacks, ran, end = CallbackQueue(world.mission, "callbacks"), [], world.clock.event()
    callbacks.call(end.wait, LONG_S)
    world.clock.sleep(0.1)

    def fail(*_args, **_options):
        raise RuntimeError("can't start new thread")

    with monkeypatch.context() as without:
        without.setattr(callbacks, "spawn", fail)
        for number in range(2 * HELPERS):
            callbacks.call_urgently(ran.append, number)
        world.clock.sleep(1.0)
    assert ran == []
    world.clock.sleep(0.2)
    assert ran == [*range(2 * HELPERS)]
    with monkeypatch.context() as without:
        without.setattr(world.clock, "call_later", fail)
        callbacks.call_urgently(ran.append, "last")  # not even the timer: it waits for its turn
    end.set()
    world.clock.sleep(0.1)
    assert ran[-1] == "last"
