"""What action clients and servers promise, on every network."""

from __future__ import annotations

import logging
import threading
import time
from collections import Counter

import pytest

from actionlib_core.action.client import ActionClient, CommState, TerminalState
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient, SimpleGoalState
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import (
    ActionException,
    IllegalTransitionError,
    ServerConflictError,
    TransportError,
    TypeMismatchError,
)
from actionlib_core.goal.client import GIVES_WAY_S
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus, GoalStatusArray
from actionlib_core.time import Duration
from actionlib_core.transport.tokens import Endpoint, Kind
from actionlib_core.wire.actions import pack_statuses
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.ros2 import server_port

S = GoalStatus
C = CommState
LONG_S = 60.0


@pytest.fixture
def refuses_late(monkeypatch):
    """Let a server take its time: on ROS 2 a goal that is undecided for long is accepted."""
    monkeypatch.setattr(server_port, "DECISION_S", LONG_S)


class Doubler:
    """A simple server: doubles the goal; a negative goal runs until it is preempted."""

    def __init__(self, world, **kwargs):
        self.runs = []
        self.started = world.event()
        self.server = SimpleActionServer(
            "demo", msg.TestAction, self.execute, False, node=world.node("server"), **kwargs
        )
        self.server.start()  # not before `self.server` is there: a goal may be waiting

    def execute(self, goal):
        self.runs.append(goal.goal)
        self.started.set()
        if goal.goal < 0:
            assert self.server.wait_preempt(LONG_S)
            self.server.set_preempted(msg.TestResult(-1), "stopped")
            return
        for index in range(3):
            self.server.publish_feedback(msg.TestFeedback(index))
        self.server.set_succeeded(msg.TestResult(2 * goal.goal), "doubled")

    def wait_started(self):
        assert self.started.wait(LONG_S)
        self.started.clear()


def simple_client(world, **kwargs):
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"), **kwargs)
    assert client.wait_for_server(LONG_S)
    return client


def send_in_order(world, client, numbers):
    """Send goals that arrive in the order in which they were sent, on every network."""
    handles = []
    for number in numbers:
        handles.append(client.send_goal(msg.TestGoal(number)))
        world.keep_order()
    return handles


def full_client(world):
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    assert client.wait_for_server(LONG_S)
    return client


# -- the simple pair -----------------------------------------------------------------------------


def test_goal_succeeds_with_feedback_and_callbacks_in_order(world):
    Doubler(world)
    client = simple_client(world)
    seen = []
    client.send_goal(
        msg.TestGoal(21),
        done_cb=lambda status, result: seen.append(
            ("done", status, result.result, client.simple_state)
        ),
        active_cb=lambda: seen.append("active"),
        feedback_cb=lambda feedback: seen.append(feedback.feedback),
    )
    assert client.wait_for_result(Duration(LONG_S))
    assert seen == ["active", 0, 1, 2, ("done", S.SUCCEEDED, 42, SimpleGoalState.DONE)]
    assert client.get_state() == S.SUCCEEDED
    assert client.get_result() == msg.TestResult(42)
    assert client.get_goal_status_text() == world.text("doubled")


def test_goals_one_after_another(world):
    doubler = Doubler(world)
    client = simple_client(world)
    for number in range(30):
        assert client.send_goal_and_wait(msg.TestGoal(number), LONG_S) == S.SUCCEEDED
        assert client.get_result().result == 2 * number
    assert doubler.runs == list(range(30))


def test_cancel_preempts(world):
    doubler = Doubler(world)
    client = simple_client(world)
    client.send_goal(msg.TestGoal(-1))
    doubler.wait_started()
    client.cancel_goal()
    assert client.wait_for_result(LONG_S)
    assert (client.get_state(), client.get_goal_status_text()) == (
        S.PREEMPTED,
        world.text("stopped"),
    )


def test_execute_timeout_cancels(world):
    doubler = Doubler(world)
    client = simple_client(world)
    state = client.send_goal_and_wait(msg.TestGoal(-1), 0.2, LONG_S)
    assert state == S.PREEMPTED or (state == S.RECALLED and not doubler.runs)  # a busy computer


def test_newer_goal_preempts_the_running_one(world):
    doubler = Doubler(world)
    first, second = simple_client(world), simple_client(world)
    first.send_goal(msg.TestGoal(-1))
    doubler.wait_started()
    assert second.send_goal_and_wait(msg.TestGoal(4), LONG_S) == S.SUCCEEDED
    assert first.wait_for_result(LONG_S)
    assert first.get_state() == S.PREEMPTED


def test_three_goals_at_once_to_a_busy_server(world):
    doubler = Doubler(world)
    client = full_client(world)
    running = client.send_goal(msg.TestGoal(-1))
    doubler.wait_started()
    others = send_in_order(world, client, (-2, -3, 7))
    for handle in (running, *others):
        assert handle.wait(LONG_S)
    states = [handle.get_terminal_state() for handle in (running, *others)]
    assert states[0] is TerminalState.PREEMPTED
    assert states[3] is TerminalState.SUCCEEDED
    # A goal that was recalled has never run; when the server is quick, it may get to one of them.
    assert doubler.runs[0] == -1
    assert doubler.runs[-1] == 7
    for number, state in zip((-2, -3), states[1:3], strict=True):
        if state is TerminalState.RECALLED or world.tells_recalls:
            assert (state is TerminalState.RECALLED) is (number not in doubler.runs)


def test_queue_policy_runs_all(world):
    queueing = Doubler(world, policy="queue")
    client = full_client(world)
    handles = send_in_order(world, client, range(5))
    assert all(handle.wait(LONG_S) for handle in handles)
    assert queueing.runs == list(range(5))


@pytest.mark.usefixtures("refuses_late")
def test_reject_policy_refuses_while_a_goal_runs(world):
    rejecting = Doubler(world, policy="reject")
    client = full_client(world)
    running = client.send_goal(msg.TestGoal(-1))
    rejecting.wait_started()
    refused = client.send_goal(msg.TestGoal(1))
    assert refused.wait(LONG_S)
    assert refused.get_terminal_state() is TerminalState.REJECTED
    running.cancel()
    assert running.wait(LONG_S)


def test_execute_callback_without_end_or_with_an_exception_aborts(world, caplog):
    def execute(goal):
        if goal.goal:
            raise RuntimeError("no battery")

    SimpleActionServer("demo", msg.TestAction, execute, node=world.node("server"))
    client = simple_client(world)
    assert client.send_goal_and_wait(msg.TestGoal(0), LONG_S) == S.ABORTED
    assert client.get_goal_status_text() == world.text("No terminal state was set.")
    assert "has returned without a terminal state" in caplog.text  # the wire may have no texts
    with caplog.at_level(logging.CRITICAL):
        assert client.send_goal_and_wait(msg.TestGoal(1), LONG_S) == S.ABORTED
    said = world.text("Exception in execute callback: no battery")
    assert client.get_goal_status_text() == said


def no_text(_error):
    raise ValueError("no text")


@pytest.mark.parametrize("base", [Exception, BaseException])
@pytest.mark.parametrize("style", ["execute", "goal callback"])
@pytest.mark.usefixtures("refuses_late")
def test_exception_without_a_text_ends_its_goal_too(world, caplog, monkeypatch, style, base):
    """Its goal stayed ACTIVE for ever, and the server took no other."""
    mute = type("Mute", (base,), {"__str__": no_text, "__repr__": no_text})
    reported = world.event()
    monkeypatch.setattr(threading, "excepthook", lambda args: reported.set())

    def fail(_):
        raise mute

    if style == "execute":
        SimpleActionServer("demo", msg.TestAction, fail, node=world.node("server"))
    else:
        ActionServer("demo", msg.TestAction, fail, node=world.node("server"))
    client = simple_client(world)
    with caplog.at_level(logging.CRITICAL):
        client.send_goal(msg.TestGoal(1))
        assert client.wait_for_result(LONG_S)
    state, said = (S.ABORTED, world.text) if style == "execute" else (S.REJECTED, world.refusal)
    assert client.get_state() == state
    callback = "execute callback" if style == "execute" else "goal callback"
    text = f"Exception in {callback}: <Mute: its text raised ValueError>"
    assert client.get_goal_status_text() == said(text)
    if (style, base) != ("execute", Exception):  # that is logged
        assert reported.wait(LONG_S)


@pytest.mark.usefixtures("refuses_late")
def test_goal_callback_style_accepts_and_rejects(world):
    server = SimpleActionServer("demo", msg.TestAction, auto_start=False, node=world.node("server"))

    def on_goal():
        if server.next_goal.get_goal().goal == 13:
            server.set_rejected(None, "unlucky")
        else:
            goal = server.accept_new_goal()
            server.set_succeeded(msg.TestResult(goal.goal))

    server.register_goal_callback(on_goal)
    server.start()
    client = simple_client(world)
    assert client.send_goal_and_wait(msg.TestGoal(13), LONG_S) == S.REJECTED
    assert client.get_goal_status_text() == world.refusal("unlucky")
    assert client.send_goal_and_wait(msg.TestGoal(3), LONG_S) == S.SUCCEEDED


def test_done_callback_sends_the_next_goal_and_waits_for_it(world):
    Doubler(world)
    client = simple_client(world)
    results, end = [], world.event()

    def on_done(_status, result):
        results.append((result.result, client.simple_state))
        if len(results) < 5:
            client.send_goal(msg.TestGoal(len(results) + 1), done_cb=on_done)
            return
        # Waiting in a callback works too, for a goal of the same client.
        assert client.send_goal_and_wait(msg.TestGoal(50), LONG_S) == S.SUCCEEDED
        results.append(client.get_result().result)
        end.set()

    client.send_goal(msg.TestGoal(1), done_cb=on_done)
    assert end.wait(LONG_S)
    assert results == [(2 * n, SimpleGoalState.DONE) for n in range(1, 6)] + [100]


def test_client_and_server_in_one_node_and_a_client_in_the_execute_callback(world):
    node = world.node("both")
    doubler = SimpleActionServer(
        "doubler",
        msg.TestAction,
        lambda g: doubler.set_succeeded(msg.TestResult(2 * g.goal)),
        node=node,
    )

    def execute(goal):
        inner = SimpleActionClient("doubler", msg.TestAction, node=node)
        assert inner.wait_for_server(LONG_S)
        inner.send_goal_and_wait(msg.TestGoal(goal.goal), LONG_S)
        outer.set_succeeded(inner.get_result())
        inner.stop()

    outer = SimpleActionServer("outer", msg.TestAction, execute, node=node)
    client = SimpleActionClient("outer", msg.TestAction, node=node)
    assert client.wait_for_server(LONG_S)
    assert client.send_goal_and_wait(msg.TestGoal(8), LONG_S) == S.SUCCEEDED
    assert client.get_result().result == 16


# -- servers that come, go and double ------------------------------------------------------------


def test_server_is_swapped_under_a_live_client(world):
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    for policy in ("queue", "reject", "preempt"):
        doubler = Doubler(world, policy=policy)
        assert client.wait_for_server(LONG_S)
        handle = client.send_goal(msg.TestGoal(4))
        assert handle.wait(LONG_S)
        assert handle.get_terminal_state() is TerminalState.SUCCEEDED, handle.get_goal_status_text()
        assert doubler.runs == [4]
        doubler.server.stop()
        world.expect_gone(client)


def test_goals_sent_as_servers_come_and_go_run_once_and_none_is_lost(world, monkeypatch):
    # After these times a server leaves though not all clients have heard it, and goals may be LOST.
    monkeypatch.setattr("actionlib_core.action.goal_keeper.DRAIN_S", LONG_S)
    monkeypatch.setattr("actionlib_core.wire.actions.FAREWELL_LIST_S", LONG_S)
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    handles, doublers = [], []

    def send(count):
        for _ in range(count):
            handles.append(client.send_goal(msg.TestGoal(len(handles))))

    for _ in range(4):
        doublers.append(Doubler(world, policy="queue"))
        send(3)
        assert handles[-3].wait(LONG_S)  # both ends know each other now
        stopping = world.clock.spawn(doublers[-1].server.stop, name="stop")
        for _ in range(5):
            send(1)
            world.clock.sleep(0.001)
        assert stopping.join(LONG_S)
        send(2)
    doublers.append(Doubler(world, policy="queue"))
    assert all(handle.wait(LONG_S) for handle in handles)
    ran = Counter(number for doubler in doublers for number in doubler.runs)
    for number, handle in enumerate(handles):
        world.check_end(handle, ran[number])
    assert doublers[-1].runs


def test_copy_of_a_goal_that_outlives_its_server_does_not_run_at_the_next(world):
    copies, seen = [], world.event()
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"))
    wire = client.action_client.node.transport
    wire.subscribe("demo/goal", lambda sample: (copies.append(sample), seen.set()))
    first = Doubler(world)
    client.send_goal(msg.TestGoal(1))
    assert client.wait_for_result(LONG_S)
    assert seen.wait(LONG_S)
    first.server.stop()
    second = Doubler(world)
    assert client.wait_for_server(LONG_S)
    sender = wire.publisher("demo/goal", copies[0].encoding)
    sender.put(copies[0].payload)
    world.keep_order()
    for number, frame in enumerate(("", "map"), 2):  # which name no server
        by_hand = msg.TestActionGoal(goal=msg.TestGoal(number))
        by_hand.header.frame_id, by_hand.goal_id.id = frame, f"by hand {number}"
        sender.put(by_hand.to_bytes())
        second.wait_started()
        world.keep_order()
    assert second.runs == [2, 3]
    assert first.runs == [1]


@pytest.mark.slow
def test_goal_runs_although_a_dead_server_still_shows_a_token(world):
    """A token may outlast its server, until the lease of a lost link is over.

    A goal may reach the elder only as long as the younger may give way; then the elder is dead.
    """
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"))
    words = msg.TestAction._type, msg.TestAction._md5sum, "0" * 32, "/dead", 1
    dead = Endpoint(Kind.ACTION_SERVER, "demo", *words)
    manager = client.action_client.manager
    manager.on_server(dead, None)
    client.send_goal(msg.TestGoal(3))
    doubler = Doubler(world)
    world.clock.sleep(GIVES_WAY_S + 0.5)
    lost = client.gh
    client.send_goal(msg.TestGoal(4))
    doubler.wait_started()
    assert client.wait_for_result(LONG_S)
    assert client.get_result().result == 8
    assert doubler.runs == [4]
    manager.on_server_gone(dead)
    assert lost.get_goal_status() == S.LOST
    assert "may or may not have begun" in lost.get_goal_status_text()


def test_goal_sent_before_the_server_exists_runs_when_it_appears(world):
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"))
    client.send_goal(msg.TestGoal(5))
    assert not client.wait_for_result(0.05)
    doubler = Doubler(world)
    assert client.wait_for_result(LONG_S)
    assert client.get_result().result == 10
    assert doubler.runs == [5]


def test_goal_without_a_server_is_lost_after_its_ack_timeout(world):
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"))
    assert not client.wait_for_server(0.02)
    client.send_goal(msg.TestGoal(5), ack_timeout=0.1)
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == S.LOST
    assert "no action server took this goal within 0.1 s" in client.get_goal_status_text()


@pytest.mark.parametrize("cancel", ["cancel_goal", "cancel_all_goals"])
def test_cancel_before_any_server_recalls_the_goal(world, cancel):
    client = SimpleActionClient("demo", msg.TestAction, node=world.node("client"))
    client.send_goal(msg.TestGoal(5))
    getattr(client, cancel)()
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == S.RECALLED


def test_goal_cancelled_while_it_is_about_to_be_sent_does_not_run(world):
    """A signal handler cancels between two lines of `send_goal`: the robot drove all the same."""
    doubler = Doubler(world)
    client = full_client(world)
    handle = client.make_goal(msg.TestGoal(5))
    handle.cancel()
    client.manager.begin(handle)
    assert handle.get_terminal_state() is TerminalState.RECALLED
    assert client.send_goal(msg.TestGoal(6)).wait(LONG_S)
    assert doubler.runs == [6]


def test_stopped_client_says_so_when_goals_are_to_be_cancelled(world):
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    client.stop()
    with pytest.raises(TransportError, match=r"action 'demo': the client is stopped\."):
        client.cancel_all_goals()
    with pytest.raises(TransportError, match=r"action 'demo': the client is stopped\."):
        client.cancel_goals_at_and_before_time(1.0)


def test_goal_that_only_an_onlooker_hears_is_recalled_at_once(world):
    heard = []
    world.node("onlooker").transport.subscribe("demo/goal", heard.append, history=False)
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    handle = client.send_goal(msg.TestGoal(5))
    handle.cancel()
    assert handle.get_terminal_state() is TerminalState.RECALLED
    assert heard == []


def test_server_behind_a_bridge_is_known_by_its_status_lists(world):
    transport = world.node("bridge").transport
    heard = world.event()
    transport.subscribe("demo/goal", lambda _: heard.set(), history=False)
    lists = transport.publisher("demo/status", encoding_of(GoalStatusArray))
    client = ActionClient("demo", msg.TestAction, node=world.node("client"))
    client.send_goal(msg.TestGoal(5))
    assert not heard.is_set()
    for _ in range(round(LONG_S / 0.2)):  # as ROS does
        lists.put(pack_statuses(world.clock.time_ns(), []))
        if heard.wait(0.2):
            break
    assert heard.is_set()


def test_server_that_leaves_its_session_makes_goals_lost(world):
    doubler = Doubler(world)
    client = simple_client(world)
    done = []
    client.send_goal(msg.TestGoal(-1), done_cb=lambda status, result: done.append((status, result)))
    doubler.wait_started()
    node = doubler.server.action_server.node
    getattr(node.transport, "kill", node.transport.close)()
    assert client.wait_for_result(LONG_S)
    assert done == [(S.LOST, None)]
    assert "node 'server'" in client.get_goal_status_text()
    doubler.server._preempted.set()  # the dead do not wait in tests


def test_stopped_server_aborts_its_goal_and_its_name_can_be_taken_again(world):
    doubler = Doubler(world)
    client = simple_client(world)
    client.send_goal(msg.TestGoal(-1))
    doubler.wait_started()
    doubler.server.stop()
    assert client.wait_for_result(LONG_S)
    assert client.get_state() in world.stopped
    Doubler(world)
    client = simple_client(world)
    assert client.send_goal_and_wait(msg.TestGoal(2), LONG_S) == S.SUCCEEDED


def test_second_server_on_a_name_is_refused_and_names_both(world):
    Doubler(world)
    client = simple_client(world)  # so that the network knows the first
    node = world.node("intruder")
    probe = SimpleActionClient("demo", msg.TestAction, node=node)
    assert probe.wait_for_server(LONG_S)
    with pytest.raises(ServerConflictError) as caught:
        SimpleActionServer("demo", msg.TestAction, lambda _: None, node=node)
    assert "'intruder'" in str(caught.value)
    assert "'server'" in str(caught.value)
    assert caught.value.other[1] in str(caught.value)
    assert client.send_goal_and_wait(msg.TestGoal(2), LONG_S) == S.SUCCEEDED


def test_second_server_that_knows_of_the_first_too_late_stops_and_the_first_goes_on(world):
    """A session that has just been opened may not have heard of anybody yet."""
    doubler = Doubler(world)
    client = simple_client(world)
    with pytest.raises(ServerConflictError):
        SimpleActionServer(
            "demo", msg.TestAction, lambda _: None, node=world.node("intruder")
        ).wait(LONG_S)
    assert client.wait_for_server(LONG_S)
    assert client.send_goal_and_wait(msg.TestGoal(2), LONG_S) == S.SUCCEEDED
    assert doubler.runs == [2]


def test_wrong_type_is_an_error_on_both_sides(world, caplog):
    Doubler(world)
    with caplog.at_level(logging.CRITICAL):
        client = SimpleActionClient("demo", msg.TestRequestAction, node=world.node("client"))
        with pytest.raises(TypeMismatchError) as caught:
            client.wait_for_server(LONG_S)
        with pytest.raises(TypeMismatchError):
            client.send_goal(client.action_client.types.goal())
    for name in world.type_names("Test", "TestRequest"):
        assert name in str(caught.value)


# -- the full pair -------------------------------------------------------------------------------


@pytest.mark.usefixtures("refuses_late")
def test_many_goals_each_accepted_rejected_or_cancelled(world):
    handles = {}

    def on_goal(handle):
        number = handle.get_goal().goal
        handles[number] = handle
        if number % 3 == 0:
            handle.set_rejected(None, "divisible")
            return
        handle.set_accepted("taken")
        if number % 3 == 1:
            handle.set_succeeded(msg.TestResult(number))

    server = ActionServer(
        "demo",
        msg.TestAction,
        on_goal,
        lambda handle: handle.set_canceled(msg.TestResult(-1), "as you wish"),
        node=world.node("server"),
    )
    client = full_client(world)
    sent = send_in_order(world, client, range(12))
    for number, handle in enumerate(sent):
        if number % 3 != 2:
            assert handle.wait(LONG_S)
    for handle in sent:
        if handle.get_comm_state() is not C.DONE:
            handle.cancel()
    assert all(handle.wait(LONG_S) for handle in sent)
    names = [handle.get_terminal_state().name for handle in sent]
    assert names == ["REJECTED", "SUCCEEDED", "PREEMPTED"] * 4
    assert sent[2].get_result() == msg.TestResult(-1)
    assert sent[0].get_goal_status_text() == world.refusal("divisible")
    with pytest.raises(IllegalTransitionError, match=r"cannot go REJECTED -> ACTIVE"):
        handles[0].set_accepted()
    server.stop()


@pytest.mark.usefixtures("refuses_late")
def test_goal_callback_that_raises_ends_the_goal(world, monkeypatch):
    raised, both = [], world.event()

    def report(args):
        raised.append(args.exc_type)
        if len(raised) == 2:
            both.set()

    monkeypatch.setattr(threading, "excepthook", report)

    def on_goal(handle):
        if handle.get_goal().goal:
            handle.set_accepted()
        raise RuntimeError("no map")

    ActionServer("demo", msg.TestAction, on_goal, node=world.node("server"))
    client = full_client(world)
    for number, state in ((0, "REJECTED"), (1, "ABORTED")):
        handle = client.send_goal(msg.TestGoal(number))
        assert handle.wait(LONG_S)
        assert handle.get_terminal_state().name == state
        said = world.refusal if state == "REJECTED" else world.text
        assert handle.get_goal_status_text() == said("Exception in goal callback: no map")
    assert both.wait(LONG_S)
    assert raised == [RuntimeError] * 2


def test_transition_callback_sees_each_state(world):
    states = []
    ActionServer(
        "demo",
        msg.TestAction,
        lambda handle: (handle.set_accepted(), handle.set_succeeded(msg.TestResult(1))),
        node=world.node("server"),
    )
    client = full_client(world)
    handle = client.send_goal(
        msg.TestGoal(1), transition_cb=lambda gh: states.append(gh.get_comm_state())
    )
    assert handle.wait(LONG_S)
    assert states[-3:] == [C.ACTIVE, C.WAITING_FOR_RESULT, C.DONE]
    assert states[:-3] in ([], [C.PENDING])


def test_cancel_all_and_cancel_before_a_time(world):
    accepted = []
    ActionServer(
        "demo",
        msg.TestAction,
        lambda handle: (accepted.append(handle), handle.set_accepted()),
        lambda handle: handle.set_canceled(),
        node=world.node("server"),
    )
    client = full_client(world)
    handles, stamps = [], []
    for number in range(4):
        active = world.event()
        handles.append(
            client.send_goal(
                msg.TestGoal(number),
                lambda gh, active=active: active.set() if gh.get_comm_state() is C.ACTIVE else None,
            )
        )
        assert active.wait(LONG_S)
        stamps.append(accepted[-1].get_goal_id().stamp)
        world.clock.sleep(0.001)
    client.cancel_goals_at_and_before_time(stamps[1])
    assert handles[0].wait(LONG_S)
    assert handles[1].wait(LONG_S)
    assert handles[2].get_comm_state() is C.ACTIVE
    client.cancel_all_goals()
    assert handles[2].wait(LONG_S)
    assert handles[3].wait(LONG_S)


def test_wrong_messages_are_refused_with_the_expected_type(world):
    Doubler(world)
    client = simple_client(world)
    with pytest.raises(ActionException, match=r"expected a message of type actionlib/TestGoal"):
        client.send_goal(msg.TestResult(1))
    with pytest.raises(ActionException, match=r"expected an action class"):
        SimpleActionClient("demo", msg.TestGoal, node=world.nodes[0])


def test_result_is_kept_for_a_client_that_attaches_later(world):
    started, go_on = world.event(), world.event()

    def execute(goal):
        started.set()
        assert go_on.wait(LONG_S)
        server.set_succeeded(msg.TestResult(goal.goal + 1))

    server = SimpleActionServer("demo", msg.TestAction, execute, node=world.node("server"))
    first = full_client(world)
    goal_id = first.send_goal(msg.TestGoal(6)).get_goal_id()
    assert started.wait(LONG_S)
    first.stop()
    second = full_client(world)
    seen = []
    handle = second.attach(goal_id, transition_cb=lambda gh: seen.append(gh.get_comm_state()))
    go_on.set()
    assert handle.wait(LONG_S)
    assert handle.get_result() == msg.TestResult(7)
    assert C.ACTIVE in seen
    unknown = second.attach("/nobody-1-1.1")
    assert unknown.wait(LONG_S)
    assert unknown.get_terminal_state() is TerminalState.LOST


@pytest.mark.parametrize("end", ["dies", "stops"])
@pytest.mark.parametrize("what", ["continue", "cancel"])
def test_client_that_dies_or_stops(world, what, end):
    doubler = Doubler(world, on_client_lost=what)
    client = simple_client(world)
    client.send_goal(msg.TestGoal(-1))
    doubler.wait_started()
    client.stop() if end == "stops" else client.action_client.node.transport.close()
    assert doubler.server.wait_preempt(LONG_S if what == "cancel" else 0.2) is (what == "cancel")
    doubler.server._preempted.set()


def test_idle_ends_have_no_thread(world):
    before = set(threading.enumerate())
    node = world.node("many")
    servers = [
        SimpleActionServer(f"idle_{n}", msg.TestAction, lambda _: None, node=node)
        for n in range(20)
    ]
    clients = [SimpleActionClient(f"idle_{n}", msg.TestAction, node=node) for n in range(20)]
    # The clock's timers and what it keeps, and zenoh's own, which are as many as call us.
    kept, deadline = {"idle", "clock-timers"}, time.monotonic() + LONG_S
    while any(
        t.name not in kept and not isinstance(t, threading._DummyThread)
        for t in set(threading.enumerate()) - before
    ):
        assert time.monotonic() < deadline
        world.clock.sleep(0.01)  # what the beginning has started comes to its end
    for end in (*servers, *clients):
        end.stop()


def test_messages_that_cannot_be_read_are_dropped_and_reported_once(world, caplog):
    doubler = Doubler(world)
    client = simple_client(world)
    transport = client.action_client.node.transport
    garbage = [transport.publisher(f"demo/{word}") for word in ("goal", "cancel", "ack", "result")]
    with caplog.at_level(logging.ERROR):
        for publisher in garbage * 20:
            publisher.put(b"\xff\x01")
        assert client.send_goal_and_wait(msg.TestGoal(2), LONG_S) == S.SUCCEEDED
    assert doubler.runs == [2]
    reports = [record for record in caplog.records if "cannot be read" in record.message]
    assert 1 <= len(reports) <= 4
    caplog.clear()
