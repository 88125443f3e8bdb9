"""Faults of ROS 1's actionlib and of rclpy, one test each: seen there, impossible here."""

from __future__ import annotations

import threading

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient, SimpleGoalState
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork

LONG_S = 60.0


class Pair:
    """Two nodes on a network in memory."""

    def __init__(self, clock):
        network = MemoryNetwork(clock)
        self.clock = clock
        self.server_node = Node("server", transport=network.session(), clock=clock)
        self.client_node = Node("client", transport=network.session(), clock=clock)

    def close(self):
        self.client_node.close()
        self.server_node.close()

    def serve(self, execute, **kwargs):
        return SimpleActionServer("demo", msg.TestAction, execute, node=self.server_node, **kwargs)

    def client(self, kind=SimpleActionClient):
        client = kind("demo", msg.TestAction, node=self.client_node)
        assert client.wait_for_server(LONG_S)
        return client


@pytest.fixture
def pair(clock):
    pair = Pair(clock)
    yield pair
    pair.close()


@pytest.fixture
def real_pair():
    pair = Pair(RealClock())
    yield pair
    pair.close()


def test_goal_that_arrives_while_another_ends_starts_at_once(pair):
    """actionlib: the wake-up was lost and the goal waited for a 100 ms poll, 50 of 50."""
    started = []

    def execute(goal):
        started.append(pair.clock.now())
        if goal.goal == 1:
            server.wait_preempt(LONG_S)
            server.set_preempted()
        else:
            server.set_succeeded()

    server = pair.serve(execute)
    client = pair.client(ActionClient)
    first = client.send_goal(msg.TestGoal(1))
    pair.clock.sleep(1.0)
    sent = pair.clock.now()
    second = client.send_goal(msg.TestGoal(2))
    assert first.wait(LONG_S)
    assert second.wait(LONG_S)
    assert started[1] == sent  # not a moment of virtual time later


@pytest.mark.slow
def test_no_early_transition_is_missed_with_busy_threads(real_pair):
    """actionlib: the handle was stored after sending; 10 of 65 goals never finished."""
    stop = threading.Event()

    def burn():
        while not stop.is_set():
            sum(range(1000))

    burners = [threading.Thread(target=burn) for _ in range(3)]
    for thread in burners:
        thread.start()
    try:
        server = real_pair.serve(lambda _: server.set_succeeded())
        client = real_pair.client()
        active = []
        for _ in range(25):
            client.send_goal(msg.TestGoal(1), active_cb=lambda: active.append(1))
            assert client.wait_for_result(LONG_S)
            assert client.get_state() == GoalStatus.SUCCEEDED
        assert len(active) == 25
    finally:
        stop.set()
        for thread in burners:
            thread.join()


def test_dead_server_ends_the_wait_and_the_goal_says_why(pair):
    """actionlib, rclpy: a killed server was never noticed, whatever the timeouts."""
    server = pair.serve(lambda _: server.wait_preempt(LONG_S))
    client = pair.client()
    client.send_goal(msg.TestGoal(1))
    pair.clock.sleep(1.0)
    pair.server_node.transport.kill()
    before = pair.clock.now()
    assert client.wait_for_result()  # for ever, as actionlib's default
    assert pair.clock.now() - before < 0.05
    assert client.get_state() == GoalStatus.LOST
    assert "is gone" in client.get_goal_status_text()


@pytest.mark.parametrize("delay_ms", range(5))
def test_cancel_shortly_after_the_goal_is_never_lost(pair, delay_ms):
    """actionlib: of 400 early cancels, 50 were reported 'aborted' and 11 lost."""

    def execute(_goal):
        assert server.wait_preempt(LONG_S)
        server.set_preempted()

    server = pair.serve(execute)
    client = pair.client()
    for _ in range(20):
        client.send_goal(msg.TestGoal(1))
        if delay_ms:
            pair.clock.sleep(delay_ms / 1000)
        client.cancel_goal()
        assert client.wait_for_result(LONG_S)
        assert client.get_state() in {GoalStatus.PREEMPTED, GoalStatus.RECALLED}
        pair.clock.sleep(0.01)


def test_raising_callbacks_leave_no_lock_held(pair, monkeypatch):
    """smach_ros: a raising result callback left a lock held; the next execute hung."""
    raised = []
    monkeypatch.setattr(threading, "excepthook", lambda args: raised.append(args.exc_type))
    server = pair.serve(lambda _: server.set_succeeded())
    client = pair.client()

    def fail(*_args):
        raise KeyError("user code")

    for _ in range(3):
        client.send_goal(msg.TestGoal(1), done_cb=fail, active_cb=fail, feedback_cb=fail)
        assert client.wait_for_result(LONG_S)
        assert client.get_state() == GoalStatus.SUCCEEDED
    assert raised == [KeyError] * 6


def test_burst_of_two_thousand_goals_loses_none(pair):
    """actionlib: the publisher's queue of 10 dropped goals silently."""
    server = ActionServer(
        "demo",
        msg.TestAction,
        lambda handle: (handle.set_accepted(), handle.set_succeeded()),
        node=pair.server_node,
    )
    client = pair.client(ActionClient)
    handles = [client.send_goal(msg.TestGoal(n)) for n in range(2000)]
    assert all(handle.wait(LONG_S) for handle in handles)
    assert {handle.get_goal_status() for handle in handles} == {GoalStatus.SUCCEEDED}
    pair.clock.sleep(1.0)
    assert server.status_list == []


def test_ended_goals_do_not_pile_up_in_the_status(pair):
    """rclpy: every status repeated all goals of the last 10 s, so a goal's cost grew with them."""
    sizes = []
    pair.client_node.transport.subscribe("demo/status", lambda s: sizes.append(len(s.payload)))
    server = pair.serve(lambda _: server.set_succeeded())
    client = pair.client()
    for _ in range(300):
        client.send_goal_and_wait(msg.TestGoal(1), LONG_S)
        pair.clock.sleep(0.1)
    assert max(sizes) < 3 * sizes[0]


def test_tail_of_the_feedback_arrives_before_done(pair):
    """rclpy: the feedback callback was dropped when the result arrived."""

    def execute(_goal):
        for number in range(500):
            server.publish_feedback(msg.TestFeedback(number))
        server.set_succeeded()

    server = pair.serve(execute)
    client = pair.client()
    seen = []
    client.send_goal(
        msg.TestGoal(1),
        feedback_cb=lambda feedback: seen.append(feedback.feedback),
        done_cb=lambda *_: seen.append("done"),
    )
    assert client.wait_for_result(LONG_S)
    assert seen == [*range(500), "done"]


def test_goal_sent_from_done_cb_is_not_marked_done(pair):
    """actionlib: done_cb ran before DONE was set, which then hit the goal sent in it."""
    server = pair.serve(lambda goal: server.set_succeeded(msg.TestResult(goal.goal)))
    client = pair.client()
    states = []

    def on_done(_status, _result):
        states.append(client.simple_state)
        client.send_goal(msg.TestGoal(2))
        states.append(client.simple_state)

    client.send_goal(msg.TestGoal(1), done_cb=on_done)
    assert client.wait_for_result(LONG_S)
    assert states == [SimpleGoalState.DONE, SimpleGoalState.PENDING]
    assert client.wait_for_result(LONG_S)
    assert client.get_result().result == 2


def test_send_goal_and_wait_leaves_the_goal_of_another_thread_alone(pair, monkeypatch):
    """actionlib: it waited for the goal that was sent last, and cancelled that."""

    def execute(goal):
        stopped = server.wait_preempt(goal.goal)
        (server.set_preempted if stopped else server.set_succeeded)()

    server = pair.serve(execute)
    client = pair.client()
    manager = client.action_client.manager
    begin = manager.begin

    def begin_and_let_another_thread_send(handle):
        monkeypatch.undo()
        begin(handle)
        client.send_goal(msg.TestGoal(10))

    monkeypatch.setattr(manager, "begin", begin_and_let_another_thread_send)
    status = client.send_goal_and_wait(msg.TestGoal(1), 3.0, 3.0)
    assert status in {GoalStatus.PENDING, GoalStatus.ACTIVE}
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == GoalStatus.SUCCEEDED


def test_falsy_results_are_sent_as_they_are(pair):
    """actionlib: `if not result` replaced them."""

    class Falsy(msg.TestResult):
        def __bool__(self):
            return False

    server = pair.serve(lambda _: server.set_succeeded(Falsy(9)))
    client = pair.client()
    client.send_goal_and_wait(msg.TestGoal(1), LONG_S)
    assert client.get_result().result == 9


def test_dropped_server_and_client_are_not_kept_by_threads(pair):
    """actionlib: the server's thread kept it alive for ever."""
    before = set(threading.enumerate())  # idle ones of other tests may end meanwhile
    server = pair.serve(lambda _: None)
    client = pair.client()
    assert set(threading.enumerate()) <= before
    client.stop()
    server.stop()


def test_three_goals_to_a_busy_server_with_the_texts_of_actionlib(pair):
    """The observed behaviour of ROS 1: running PREEMPTED, first two RECALLED, last ACTIVE."""

    def execute(_goal):
        server.wait_preempt(LONG_S)
        pair.clock.sleep(1.0)
        server.set_preempted()

    server = pair.serve(execute)
    client = pair.client(ActionClient)
    handles = [client.send_goal(msg.TestGoal(0))]
    pair.clock.sleep(1.0)
    handles += [client.send_goal(msg.TestGoal(n)) for n in (1, 2, 3)]
    pair.clock.sleep(1.5)
    names = {value: name for name, value in vars(GoalStatus).items() if isinstance(value, int)}
    assert [names[handle.get_goal_status()] for handle in handles] == [
        "PREEMPTED",
        "RECALLED",
        "RECALLED",
        "ACTIVE",
    ]
    assert handles[1].get_goal_status_text() == (
        "This goal was canceled because another goal was received by the simple action server"
    )
    assert handles[3].get_goal_status_text() == (
        "This goal has been accepted by the simple action server"
    )


def test_goal_without_id_gets_one_and_cancel_of_an_unknown_id_is_listed(pair):
    """The observed behaviour of ROS 1 on the wire."""
    from actionlib_core.wire.actions import pack_goal, pack_goal_id, unpack_statuses
    from actionlib_core.wire.encoding import encoding_of

    runs = []
    ActionServer(
        "demo",
        msg.TestAction,
        lambda handle: (runs.append(handle.get_goal_id().id), handle.set_accepted()),
        node=pair.server_node,
    )
    lists = []
    transport = pair.client_node.transport
    transport.subscribe("demo/status", lambda s: lists.append(unpack_statuses(s.payload)))
    goals = transport.publisher("demo/goal", encoding_of(msg.TestActionGoal))
    cancels = transport.publisher("demo/cancel")
    goals.put(pack_goal(0, "", 0, msg.TestGoal(1).to_bytes()))
    cancels.put(pack_goal_id("later", 0))
    pair.clock.sleep(0.1)
    assert runs[0].startswith("/server-")
    assert ("later", 7) in [(entry.id, entry.status) for entry in lists[-1]]
    goals.put(pack_goal(0, "later", 0, msg.TestGoal(1).to_bytes()))
    pair.clock.sleep(0.1)
    assert len(runs) == 1
    assert ("later", 8) in [(entry.id, entry.status) for entry in lists[-1]]
