"""Programs that make mistakes, and calls that meet at a bad moment: each told at once, none lost."""

from __future__ import annotations

import functools
import logging
import threading

import pytest

from actionlib_core import shutdown
from actionlib_core.action import client as action_client
from actionlib_core.action.client import ActionClient, CommState
from actionlib_core.action.decorated import Reject, server
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient, SimpleGoalState
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import RealClock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.goal.bounded import Backlog
from actionlib_core.goal.client import ClientGoal
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.node import Node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Publisher, Subscriber
from actionlib_core.time import Duration
from actionlib_core.transport.memory import MemoryNetwork

LONG_S = 60.0


@pytest.fixture
def network(clock):
    return MemoryNetwork(clock)


@pytest.fixture
def nodes(clock, network):
    made = [Node(name, transport=network.session(), clock=clock) for name in ("server", "client")]
    yield made
    for node in reversed(made):
        node.close()


@pytest.fixture
def node():
    """A node on the real clock, in a network of its own."""
    clock = RealClock()
    with Node("both", transport=MemoryNetwork(clock).session(), clock=clock) as node:
        yield node


# -- moments -----------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["cancel", "stop"])
def test_goal_that_ends_as_its_server_appears_is_not_sent(nodes, clock, monkeypatch, end):
    """The client said RECALLED, or was stopped, and the server ran the goal all the same."""
    server_node, client_node = nodes
    client = ActionClient("demo", msg.TestAction, node=client_node)
    handle = client.send_goal(msg.TestGoal(1))
    port = client.manager.port

    def heard():
        """Somebody listens now; meanwhile another thread ends the goal."""
        monkeypatch.undo()
        handle.cancel() if end == "cancel" else client.stop()
        return True

    monkeypatch.setattr(port, "is_heard", heard)
    ran = []
    server = ActionServer("demo", msg.TestAction, ran.append, node=server_node)
    clock.sleep(LONG_S)
    server.stop()
    assert ran == []
    expected = GoalStatus.RECALLED if end == "cancel" else GoalStatus.LOST
    assert handle.get_goal_status() == expected


class _Moments:
    """An event of a clock that calls something just after it was cleared, or as a wait begins."""

    def __init__(self, event, waiting):
        self._event = event
        self._waiting = waiting
        self.set = event.set
        self.clear = event.clear

    def wait(self, timeout=None):
        self._waiting()
        return self._event.wait(timeout)


def test_loops_over_the_feedback_of_one_goal_all_end(node):
    """Two loops: one cleared the news that the goal is over, and the other waited for ever."""
    release = threading.Event()

    def execute(goal):
        assert release.wait(LONG_S)
        server.set_succeeded()

    server = SimpleActionServer("demo", msg.TestAction, execute, node=node)
    client = ActionClient("demo", msg.TestAction, node=node)
    sent = client.send(msg.TestGoal(1))
    looped = []

    def loop_in_between():
        """As this loop is about to wait, the goal ends, and another loop hears of it first."""
        sent._changed = event
        release.set()
        assert sent.wait(LONG_S)
        looped.append(list(sent.feedback()))

    event = sent._changed
    sent._changed = _Moments(event, loop_in_between)
    waiting = threading.Thread(target=lambda: looped.append(list(sent.feedback())), daemon=True)
    waiting.start()
    waiting.join(LONG_S)
    assert looped == [[], []]


def test_feedback_taken_by_another_loop_is_no_error(node):
    """Two loops: one saw the last feedback, the other took it, and the first one raised."""

    class Shared(Backlog):
        """Feedback of which another loop takes the last just before we do."""

        def take(self):
            super().take()

    client = ActionClient("demo", msg.TestAction, node=node)
    sent = client.send(msg.TestGoal(1))
    sent._handle.feedback = Shared()
    sent._handle.feedback.add(msg.TestFeedback(1), 4)
    client.stop()
    assert sent.over
    assert list(sent.feedback()) == []


def test_goal_callback_finds_a_goal_that_waits(nodes, clock):
    """Goals in a row: one callback accepted the newest, the next one got None to work with."""
    server_node, client_node = nodes
    server = SimpleActionServer("demo", msg.TestAction, auto_start=False, node=server_node)
    accepted = []

    def on_goal():
        clock.sleep(1.0)
        accepted.append(server.accept_new_goal().goal)

    server.register_goal_callback(on_goal)
    server.start()
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    handles = [client.send_goal(msg.TestGoal(number)) for number in range(3)]
    clock.sleep(LONG_S)
    assert accepted == [2]
    server.set_succeeded()
    assert handles[2].wait(LONG_S)
    ends = [handle.get_goal_status() for handle in handles]
    assert ends == [GoalStatus.RECALLED, GoalStatus.RECALLED, GoalStatus.SUCCEEDED]


def test_preempt_callback_is_not_called_for_a_goal_that_has_ended(nodes, clock):
    """It ended the next goal, or raised: the goal it was for had just ended."""
    server_node, client_node = nodes
    server = SimpleActionServer("demo", msg.TestAction, auto_start=False, node=server_node)
    preempted = []
    server.register_goal_callback(server.accept_new_goal)
    server.register_preempt_callback(lambda: preempted.append(server.set_preempted()))
    server.start()
    client = SimpleActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    for late in (True, False):
        client.send_goal(msg.TestGoal(1))
        clock.sleep(1.0)
        if late:
            server.action_server.callback_queue.call(clock.sleep, 1.0)
        client.cancel_goal()
        if late:
            clock.sleep(0.01)  # less than a preempt callback waits for others
            server.set_succeeded()
        assert client.wait_for_result(LONG_S)
        expected = GoalStatus.SUCCEEDED if late else GoalStatus.PREEMPTED
        assert client.get_state() == expected
    assert preempted == [None]


def test_cancel_of_a_goal_in_a_queue_is_seen_when_it_is_accepted(nodes, clock):
    """Its client said PREEMPTING, and the server never knew."""
    server_node, client_node = nodes
    server = SimpleActionServer(
        "demo", msg.TestAction, auto_start=False, node=server_node, policy="queue"
    )
    server.register_goal_callback(lambda: None)
    server.start()
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    handles = [client.send_goal(msg.TestGoal(number)) for number in range(3)]
    clock.sleep(1.0)
    handles[1].cancel()
    clock.sleep(1.0)
    asked = []
    for _ in handles:
        server.accept_new_goal()
        asked.append(server.is_preempt_requested())
        server.set_preempted() if asked[-1] else server.set_succeeded()
    assert asked == [False, True, False]
    assert all(handle.wait(LONG_S) for handle in handles)
    assert handles[1].get_goal_status() == GoalStatus.PREEMPTED
    server.stop()


def test_cancel_callback_is_not_called_for_a_goal_that_has_ended(nodes, clock):
    server_node, client_node = nodes
    taken, cancelled = [], []

    def on_goal(handle):
        handle.set_accepted()
        taken.append(handle)
        clock.sleep(2.0)

    server = ActionServer("demo", msg.TestAction, on_goal, cancelled.append, node=server_node)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(msg.TestGoal(1))
    clock.sleep(0.5)
    handle.cancel()
    clock.sleep(0.01)  # less than a cancel callback waits for others
    taken[0].set_succeeded()
    assert handle.wait(LONG_S)
    clock.sleep(2.0)
    assert cancelled == []
    server.stop()


def test_wait_of_a_handle_covers_its_feedback_callbacks(nodes, clock):
    server_node, client_node = nodes

    def on_goal(handle):
        handle.set_accepted()
        handle.publish_feedback(msg.TestFeedback(1))
        handle.set_succeeded()

    server = ActionServer("demo", msg.TestAction, on_goal, node=server_node)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    heard = []

    def on_feedback(handle, feedback):
        clock.sleep(1.0)
        heard.append(feedback.feedback)

    handle = client.send_goal(msg.TestGoal(1), feedback_cb=on_feedback)
    assert handle.wait(LONG_S)
    assert heard == [1]
    server.stop()


def test_callback_may_wait_for_another_goal_of_its_client(nodes, clock):
    """The wait was for a callback behind the one that waited."""
    server_node, client_node = nodes

    def on_goal(handle):
        handle.set_accepted()
        handle.set_succeeded()

    server = ActionServer("demo", msg.TestAction, on_goal, node=server_node)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    waited = []

    def on_transition(handle):
        if handle.get_comm_state() == CommState.DONE:
            other = client.send_goal(msg.TestGoal(2), lambda _: None)
            waited.append((other.wait(LONG_S), other.get_goal_status()))

    assert client.send_goal(msg.TestGoal(1), on_transition).wait(LONG_S)
    assert waited == [(True, GoalStatus.SUCCEEDED)]
    assert clock.now() < LONG_S
    server.stop()


def test_stopped_client_waits_for_no_server(nodes):
    server_node, client_node = nodes
    server = ActionServer("demo", msg.TestAction, node=server_node)
    client = SimpleActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    client.stop()
    assert not client.wait_for_server()
    server.stop()


def test_wait_for_a_server_ends_with_the_program(nodes, clock):
    """The first Ctrl-C left it waiting."""
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    with shutdown.use_shutdown(shutdown.Shutdown()) as end:
        clock.call_later(4.0, end.request)
        assert not client.wait_for_server()
        assert clock.now() == pytest.approx(4.0)
        assert not client.wait_for_server()
        assert clock.now() == pytest.approx(4.0)
        ActionServer("demo", msg.TestAction, node=nodes[0])
        assert client.wait_for_server(LONG_S)
        assert client.wait_for_server()
    assert client.action_client.manager._waiters == []


def test_goal_that_the_end_of_the_program_cancels_is_waited_for(nodes, clock):
    def execute(_goal):
        assert server.wait_preempt(LONG_S)
        clock.sleep(1.0)
        server.set_preempted()

    server = SimpleActionServer("demo", msg.TestAction, execute, auto_start=False, node=nodes[0])
    server.start()
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    with shutdown.use_shutdown(shutdown.Shutdown()) as end:
        shutdown.on_shutdown(client.cancel_goal)
        clock.call_later(4.0, end.request)
        client.send_goal(msg.TestGoal(1))
        assert client.wait_for_result()
    assert client.get_state() == GoalStatus.PREEMPTED
    assert clock.now() == pytest.approx(5.0, abs=0.1)


def test_server_whose_session_is_closed_stops(nodes, clock):
    """`stop` raised, and who waited for the server waited for ever."""
    server_node, client_node = nodes
    server = ActionServer("demo", msg.TestAction, node=server_node)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    for number in range(3):
        client.send_goal(msg.TestGoal(number))
    clock.sleep(1.0)
    taken = server.status_list
    taken[0].set_accepted()
    server_node.transport.close()
    server.stop()
    assert server.wait(LONG_S)
    assert server.stopped
    ends = [tracker.status.status for tracker in taken]
    assert ends == [GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.REJECTED]


def test_server_whose_session_is_closed_sends_its_status_no_more(nodes, clock, caplog):
    """The clock's timers got an error five times a second, until the end of the program."""
    server_node, client_node = nodes
    server = ActionServer("demo", msg.TestAction, node=server_node)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    client.send_goal(msg.TestGoal(1))
    clock.sleep(1.0)
    server_node.transport.close()
    caplog.clear()
    clock.sleep(5.0)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    server.stop()


def test_simple_server_whose_session_is_closed_stops(nodes, clock):
    """Nor was the execute callback told to stop."""
    server_node, client_node = nodes
    told = []

    def execute(goal):
        told.append(server.wait_preempt(LONG_S))

    server = SimpleActionServer("demo", msg.TestAction, execute, node=server_node, policy="queue")
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    for number in range(3):
        client.send_goal(msg.TestGoal(number))
    clock.sleep(1.0)
    server_node.transport.close()
    server.stop()
    assert told == [True]
    assert server.wait(LONG_S)
    assert clock.now() < 2.0


@pytest.mark.parametrize("how", ["send", "stop tracking"])
def test_send_goal_and_wait_cancels_only_its_own_goal(nodes, clock, how):
    """It cancelled the goal that another thread had sent meanwhile, and returned its status."""
    handles = {}

    def take(handle):
        handle.set_accepted()
        handles[handle.get_goal().goal] = handle

    ActionServer("demo", msg.TestAction, take, node=nodes[0])
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    states = []
    task = clock.spawn(
        lambda: states.append(client.send_goal_and_wait(msg.TestGoal(1), LONG_S)), name="waits"
    )
    clock.sleep(1.0)
    began = clock.now()
    if how == "send":
        client.send_goal(msg.TestGoal(2))
    else:
        client.stop_tracking_goal()
    task.join()
    assert clock.now() == began
    assert states == [GoalStatus.ACTIVE]
    clock.sleep(1.0)
    assert [handle.get_goal_status().status for handle in handles.values()] == (
        [GoalStatus.ACTIVE] * (2 if how == "send" else 1)
    )
    client.stop()


# -- mistakes ----------------------------------------------------------------------------------


def test_goal_to_follow_has_an_id(nodes):
    client = ActionClient("demo", msg.TestAction, node=nodes[1])
    for wrong in ("", 3, None, "\udcff"):
        with pytest.raises(ActionlibError, match=r"demo.*goal id: got .*; expected"):
            client.attach(wrong)
        with pytest.raises(ActionlibError, match=r"demo.*goal id: got .*; expected"):
            client.follow(wrong)


def test_goal_is_followed_once_by_one_client(nodes, clock, monkeypatch):
    """Of two that began at once, one was never told of the end."""
    client = ActionClient("demo", msg.TestAction, node=nodes[1])
    both = threading.Barrier(2, timeout=LONG_S)

    def meet(*args, **kwargs):
        both.wait()
        return ClientGoal(*args, **kwargs)

    monkeypatch.setattr(action_client, "ClientGoal", meet)
    handles, errors = [], []

    def attach():
        try:
            handles.append(client.attach("/nobody-1"))
        except ActionlibError as error:
            errors.append(str(error))

    threads = [threading.Thread(target=attach) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(LONG_S)
    assert errors == ["goal /nobody-1 on 'demo': this client follows it already."]
    client.stop()
    assert handles[0].wait(1.0)


def test_goal_stays_followed_when_it_is_attached_to_again(nodes, clock):
    """The client refused, and had let go of the goal before."""
    SimpleActionServer("demo", msg.TestAction, lambda _: clock.sleep(1.0), node=nodes[0])
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    done = []
    client.send_goal(msg.TestGoal(1), done_cb=lambda status, _: done.append(status))
    handle = client.gh
    with pytest.raises(ActionlibError, match="this client follows it already"):
        client.attach(handle.get_goal_id())
    assert client.gh is handle
    assert client.wait_for_result(LONG_S)
    assert done == [GoalStatus.ABORTED]


def test_goal_that_was_let_go_of_is_followed_again(nodes, clock):
    SimpleActionServer("demo", msg.TestAction, lambda _: clock.sleep(5.0), node=nodes[0])
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    seen = []

    def callbacks(name):
        return {
            "done_cb": lambda status, _: seen.append((name, status)),
            "active_cb": lambda: seen.append((name, "active")),
        }

    client.send_goal(msg.TestGoal(1), **callbacks("first"))
    clock.sleep(1.0)
    goal_id = client.gh.get_goal_id()
    client.stop_tracking_goal()
    assert client.gh is None
    client.attach(goal_id, **callbacks("again"))
    assert client.simple_state is SimpleGoalState.ACTIVE
    assert not client.wait_for_result(1.0)
    assert client.wait_for_result(LONG_S)
    aborted = GoalStatus.ABORTED
    assert seen == [("first", "active"), ("again", "active"), ("again", aborted)]


def test_goal_that_was_let_go_of_before_any_server_was_there_is_followed_again(nodes, clock):
    """It is still sent: following it by its id must not make it one that is only asked for."""
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    client.send_goal(msg.TestGoal(1), ack_timeout=5.0)
    goal_id = client.gh.get_goal_id()
    client.stop_tracking_goal()
    clock.sleep(4.0)
    client.attach(goal_id, ack_timeout=30.0)
    clock.sleep(4.0)
    SimpleActionServer("demo", msg.TestAction, lambda _: clock.sleep(1.0), node=nodes[0])
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == GoalStatus.ABORTED


@pytest.mark.parametrize("kind", [ActionClient, SimpleActionClient])
def test_timeouts_of_a_client_are_times(nodes, kind):
    """None for the server's absence raised in the network's thread, and no goal was ever LOST."""
    where = "action 'demo': server_lost_timeout: got "
    for value in (None, -1, float("nan"), float("inf"), "1"):
        with pytest.raises(ActionlibError, match=where):
            kind("demo", msg.TestAction, node=nodes[1], server_lost_timeout=value)
    client = kind("demo", msg.TestAction, node=nodes[1])
    for value in (-1, float("nan"), "1"):
        with pytest.raises(ActionlibError, match="action 'demo': ack_timeout: got "):
            client.send_goal(msg.TestGoal(1), ack_timeout=value)
        with pytest.raises(ActionlibError, match="action 'demo': ack_timeout: got "):
            client.attach("/nobody-1", ack_timeout=value)
    client.send_goal(msg.TestGoal(1), ack_timeout=float("inf"))
    client.cancel_all_goals()


def test_callbacks_are_functions(nodes):
    """A callback that is none was reported when it was due, from a thread without a place."""
    node = nodes[0]
    simple = SimpleActionClient("demo", msg.TestAction, node=node)
    client = ActionClient("demo", msg.TestAction, node=node)
    server = ActionServer("demo", msg.TestAction, auto_start=False, node=node)
    runner = SimpleActionServer("demo", msg.TestAction, auto_start=False, node=node)
    goal = msg.TestGoal(1)
    calls = {
        "done_cb": lambda: simple.send_goal(goal, "done"),
        "active_cb": lambda: simple.send_goal(goal, active_cb=1),
        "feedback_cb": lambda: simple.send_goal(goal, feedback_cb=1),
        "transition_cb": lambda: client.send_goal(goal, 1),
        "goal_cb": lambda: ActionServer("demo", msg.TestAction, 1, auto_start=False, node=node),
        "cancel_cb": lambda: server.register_cancel_callback(1),
        "execute_cb": lambda: SimpleActionServer("demo", msg.TestAction, 1, node=node),
        "cb": lambda: runner.register_preempt_callback(1),
        "handler": lambda: Service("demo", Trigger, 1, node=node),
        "callback": lambda: Subscriber("demo", String, 1, node=node),
    }
    for what, call in calls.items():
        with pytest.raises(ActionlibError, match=rf"demo.*: {what}: got .*; expected a function"):
            call()
    assert simple.get_state() == GoalStatus.LOST  # no goal was sent


async def coroutine(*_args):
    pass


def generator(*_args):
    yield


class AsyncCall:
    async def __call__(self, *_args):
        pass


@pytest.mark.parametrize(
    "lazy", [coroutine, generator, functools.partial(coroutine, 1), AsyncCall(), AsyncCall.__call__]
)
def test_callbacks_run_when_they_are_called(nodes, lazy):
    """The body of such a callback never ran: messages were lost, goals aborted, without a reason."""
    node = nodes[0]
    simple = SimpleActionClient("demo", msg.TestAction, node=node)
    calls = {
        "done_cb": lambda: simple.send_goal(msg.TestGoal(1), lazy),
        "feedback_cb": lambda: simple.send_goal(msg.TestGoal(1), feedback_cb=lazy),
        "execute_cb": lambda: SimpleActionServer("demo", msg.TestAction, lazy, node=node),
        "goal_cb": lambda: ActionServer("demo", msg.TestAction, lazy, node=node),
        "handler": lambda: Service("demo", Trigger, lazy, node=node),
        "callback": lambda: Subscriber("demo", String, lazy, node=node),
    }
    if lazy is generator:  # an `async` one is run
        calls["function"] = lambda: server("demo", msg.TestAction)(lazy)
    for what, call in calls.items():
        with pytest.raises(
            ActionlibError, match=rf"demo.*: {what}: got .*whose body would not run"
        ):
            call()
    assert simple.get_state() == GoalStatus.LOST  # no goal was sent


@pytest.mark.parametrize("end", ["set_canceled", "set_rejected", "set_aborted", "set_succeeded"])
def test_text_that_is_none_leaves_the_goal_as_it_was(nodes, clock, end):
    """The goal had ended, without a result that could be sent: its client waited for ever."""
    taken = []
    server = ActionServer("demo", msg.TestAction, taken.append, node=nodes[0])
    client = ActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    sent = client.send_goal(msg.TestGoal(1))
    clock.sleep(1.0)
    with pytest.raises(ActionlibError, match=r"demo.*set_accepted.*: text: got 5; expected a str"):
        taken[0].set_accepted(5)
    assert taken[0].get_goal_status().status == GoalStatus.PENDING
    if end not in {"set_canceled", "set_rejected"}:
        taken[0].set_accepted()
    with pytest.raises(ActionlibError, match=rf"demo.*{end}.*: text: got ValueError.*; expected"):
        getattr(taken[0], end)(text=ValueError("no"))
    getattr(taken[0], end)(text="a file caf\udce9.yaml")
    assert sent.wait(LONG_S)
    assert sent.get_goal_status_text() == "a file caf\\udce9.yaml"
    assert server.status_list
    server.stop()


@pytest.fixture
def unlogged():
    """Keep logs out of the report, where pytest's workers could not send the text either."""
    logging.disable(logging.CRITICAL)
    yield
    logging.disable(logging.NOTSET)


def test_error_whose_text_cannot_be_sent_ends_its_goal(nodes, unlogged):
    def execute(goal):
        raise OSError("no file caf\udce9.yaml")

    server = SimpleActionServer("demo", msg.TestAction, execute, node=nodes[0])
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    client.send_goal(msg.TestGoal(1))
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == GoalStatus.ABORTED
    assert client.get_goal_status_text().endswith("no file caf\\udce9.yaml")
    server.stop()


@pytest.mark.parametrize("wrong", [None, -1.0, float("nan"), float("inf"), "60"])
def test_result_timeout_is_a_number(nodes, wrong):
    """With None the goal ended, and its result was never sent."""
    for make in (ActionServer, SimpleActionServer):
        with pytest.raises(
            ActionlibError, match=r"demo.*: result_timeout: got .*; expected seconds"
        ):
            make("demo", msg.TestAction, node=nodes[0], result_timeout=wrong)
    make("demo", msg.TestAction, node=nodes[0], result_timeout=Duration(2)).stop()


@pytest.mark.parametrize("kind", [ActionServer, SimpleActionServer])
def test_stopped_server_is_not_started_again(nodes, kind):
    """It said nothing, and offered nothing."""
    server = kind("demo", msg.TestAction, node=nodes[0])
    server.start()
    server.stop()
    server.stop()
    with pytest.raises(ActionlibError, match=r"demo.*start\(\): .*stopped; expected.* Try making"):
        server.start()


@pytest.mark.parametrize("kind", [ActionServer, SimpleActionServer])
def test_stop_before_the_start_changes_nothing(nodes, kind):
    """A server that was started then was seen, and ignored every goal."""
    server = kind("demo", msg.TestAction, auto_start=False, node=nodes[0])
    server.stop()
    server.start()
    client = ActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(msg.TestGoal(1))
    assert not handle.wait(1.0)
    assert handle.get_comm_state() == CommState.PENDING
    server.stop()
    assert handle.wait(LONG_S)


@pytest.mark.parametrize("way", ["call", "raise"])
def test_execute_callback_cannot_reject_and_is_told_what_can(nodes, caplog, way):
    """Its goal is ACTIVE, which no goal is rejected from, in actionlib's table as here."""

    def execute(goal):
        if way == "raise":
            raise Reject("too far")
        server.set_rejected(text="too far")

    server = SimpleActionServer("demo", msg.TestAction, execute, node=nodes[0])
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    client.send_goal(msg.TestGoal(1))
    assert client.wait_for_result(LONG_S)
    assert client.get_state() == GoalStatus.ABORTED
    said = client.get_goal_status_text()
    if way == "raise":
        assert said == "Exception in execute callback: too far"
    else:
        assert "set_rejected(): the goal that runs is accepted already" in said
        assert "Try set_aborted(), or @server" in said
    server.stop()


def test_service_class_is_one(nodes):
    for make in (ServiceProxy, lambda *args, **kw: Service(*args, print, **kw)):
        with pytest.raises(ActionlibError, match=r"demo.*got .*String.*; expected a service class"):
            make("demo", String, node=nodes[0])


def test_topic_class_is_one(nodes):
    for make in (Publisher, Subscriber):
        with pytest.raises(ActionlibError, match=r"demo.*got .*; expected a message class"):
            make("demo", Trigger, node=nodes[0])
        with pytest.raises(ActionlibError, match=r"demo.*queue_size: got .*; expected"):
            make("demo", String, queue_size="many", node=nodes[0])


def test_handler_that_ends_its_thread_answers(nodes, caplog):
    """The caller was told that the server had died."""

    def handler(request):
        raise SystemExit("enough")

    Service("demo", Trigger, handler, node=nodes[0])
    with pytest.raises(ActionlibError, match="the handler raised SystemExit: enough"):
        ServiceProxy("demo", Trigger, node=nodes[1])()
    assert "the handler raised" in caplog.text


def test_done_callback_that_ends_its_thread_holds_nobody_up(nodes, caplog):
    """It was the last callback that this client ever called, and the wait never ended."""
    server = SimpleActionServer(
        "demo", msg.TestAction, lambda _: server.set_succeeded(), node=nodes[0]
    )
    client = SimpleActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    done = []

    def leave(*_):
        raise SystemExit("enough")

    client.send_goal(msg.TestGoal(1), done_cb=leave)
    assert client.wait_for_result(LONG_S)
    client.send_goal(msg.TestGoal(2), done_cb=lambda status, _: done.append(status))
    assert client.wait_for_result(LONG_S)
    assert done == [GoalStatus.SUCCEEDED]
    assert "a callback raised SystemExit: enough" in caplog.text
    server.stop()


@pytest.mark.parametrize("policy", ["queue", "preempt"])
def test_execute_callback_that_ends_its_thread_holds_no_goal_up(nodes, clock, policy):
    """The goals that waited were never started."""
    server_node, client_node = nodes

    def execute(goal):
        clock.sleep(1.0)
        if goal.goal == 1:
            raise SystemExit("enough")
        server.set_succeeded()

    server = SimpleActionServer("demo", msg.TestAction, execute, node=server_node, policy=policy)
    client = ActionClient("demo", msg.TestAction, node=client_node)
    assert client.wait_for_server(LONG_S)
    first = client.send_goal(msg.TestGoal(1))
    clock.sleep(0.5)
    second = client.send_goal(msg.TestGoal(2))
    assert first.wait(LONG_S)
    assert first.get_goal_status() == GoalStatus.ABORTED
    assert "SystemExit('enough')" in first.get_goal_status_text()
    assert second.wait(LONG_S)
    assert second.get_goal_status() == GoalStatus.SUCCEEDED
    server.stop()


def test_goal_callback_that_ends_its_thread_ends_the_goal(nodes, caplog):
    """The goal stayed PENDING, without anybody who could end it."""

    def on_goal(handle):
        raise SystemExit("enough")

    server = ActionServer("demo", msg.TestAction, on_goal, node=nodes[0])
    client = ActionClient("demo", msg.TestAction, node=nodes[1])
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(msg.TestGoal(1))
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.REJECTED
    assert handle.get_goal_status_text() == "Exception in goal callback: SystemExit('enough')"
    server.stop()


def test_wrong_policy_and_callback_leave_nothing_behind(nodes):
    with pytest.raises(ActionlibError):
        SimpleActionServer("demo", msg.TestAction, 1, node=nodes[0])
    server = SimpleActionServer("demo", msg.TestAction, print, node=nodes[0])
    server.stop()
