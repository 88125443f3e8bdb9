"""Our action clients at a server of ROS 2 that answers as a test says, in virtual time."""

from __future__ import annotations

import contextlib
import itertools
import threading
from collections import deque

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.config import Config, Ros2
from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.goal.states import CommState, Status
from actionlib_core.interfaces.move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseGoal,
    MoveBaseResult,
)
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.action_messages import pack_accepted
from actionlib_core.wire.ros2.client_port import MAX_IN_FLIGHT
from actionlib_core.wire.ros2.goal_exchange import SETTLED_S
from actionlib_core.wire.ros2.graph import RosNode
from actionlib_core.wire.ros2.link_probe import LinkProbe
from actionlib_core.wire.ros2.names import Kind, goal_uuid
from actionlib_core.wire.ros2.network import ANSWER_S, MIN_ANSWER_S, ros_network
from tests.ros2_server import Ros2Server


class World:
    """A mission's node, whose link can be cut, and a robot's session beside it."""

    def __init__(self, clock):
        self.clock, self.network = clock, MemoryNetwork(clock)
        self.left = contextlib.ExitStack()
        self.link = FaultyTransport(self.network.session(), clock=clock, lease=60.0)
        self.mission = self.node(self.link)
        self.robot = self.session()

    def node(self, transport, **settings):
        config = Config(ros2=(Ros2(**settings),))
        node = Node("mission", transport=transport, clock=self.clock, config=config)
        self.left.callback(transport.close)
        self.left.callback(node.close)
        return node

    def session(self):
        session = self.network.session()
        self.left.callback(session.close)
        return session

    def server(self, action=Fibonacci, **options):
        return Ros2Server(self.robot, self.clock, "fib", action, **options)

    def client(self, node=None, action=Fibonacci, **options):
        client = ActionClient("fib", action, node=node or self.mission, **options)
        assert client.wait_for_server(5.0)
        return client


@pytest.fixture
def world(clock):
    made = World(clock)
    with made.left:
        yield made


def begin(server, client, order=3):
    """Send a goal, and wait until the server has it and the question for its result."""
    states = []
    handle = client.send_goal(
        Fibonacci.Goal(order=order), lambda goal: states.append(goal.get_comm_state().name)
    )
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: uuid in server.asked)
    return handle, uuid, states


def test_goal_is_sent_once_and_its_result_asked_for_at_once(world):
    server, client = world.server(), world.client()
    handle, uuid, states = begin(server, client, order=5)
    server.set_state(uuid, 2)
    world.clock.sleep(120.0)
    server.end(uuid, 4, Fibonacci.Result(sequence=[1, 2]))
    assert handle.wait(5.0)
    assert handle.get_result() == Fibonacci.Result(sequence=[1, 2])
    assert handle.get_terminal_state() == Status.SUCCEEDED
    assert states == ["PENDING", "ACTIVE", "WAITING_FOR_RESULT", "DONE"]
    assert (server.sent, server.goals[uuid].order) == ([uuid], 5)
    assert len(server._seen) == 2  # the goal and one question
    assert server.problems == []


def test_refused_goal_is_rejected(world):
    server, client = world.server(), world.client()
    server.on_goal = server.refuse
    handle = client.send_goal(Fibonacci.Goal(order=1))
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.REJECTED
    assert handle.get_result() == Fibonacci.Result()


@pytest.mark.parametrize(("code", "status"), [(5, Status.PREEMPTED), (6, Status.ABORTED)])
def test_other_ends(world, code, status):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    server.end(uuid, code)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == status


def test_result_that_is_cut_short_is_lost_with_its_reason(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    for question in server.asked.pop(uuid):
        server.reply(question, b"\0\1\0\0\4\0")  # "succeeded", and then nothing
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.LOST
    text = handle.get_goal_status_text()
    assert text.startswith("the server sent a result that cannot be read: test_msgs/action/Fibonac")


def test_feedback_before_the_acceptance_and_result_before_the_last_state(world):
    server, client = world.server(), world.client()
    seen, states, kept = [], [], []
    server.on_goal = lambda query, uuid: kept.append((query, uuid))
    handle = client.send_goal(
        Fibonacci.Goal(order=1),
        lambda goal: states.append(goal.get_comm_state().name),
        lambda _, feedback: seen.append(list(feedback.sequence)),
    )
    server.wait(lambda: kept)
    query, uuid = kept[0]
    server.states[uuid] = 2
    for numbers in ([0], [0, 1]):
        server.publish_feedback(uuid, Fibonacci.Feedback(sequence=numbers))
    world.clock.sleep(0.1)
    server.reply(query, pack_accepted(1))
    for question in server.asked.pop(uuid):
        server.answer_result(question, 4, Fibonacci.Result(sequence=[7]))
    assert handle.wait(5.0)
    server.set_state(uuid, 4)
    assert seen == [[0], [0, 1]]
    assert states == ["ACTIVE", "WAITING_FOR_RESULT", "DONE"]
    assert list(handle.get_result().sequence) == [7]


def test_goal_of_another_client_says_nothing(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(bytes(range(16)), 2)
    server.publish_feedback(bytes(range(16)), Fibonacci.Feedback(sequence=[1]))
    server.end(bytes(range(16)), 4)
    world.clock.sleep(1.0)
    assert handle.get_comm_state() == CommState.PENDING
    server.end(uuid, 4)
    assert handle.wait(5.0)


# -- doubt -----------------------------------------------------------------------------------------


def drop(query, uuid):
    """End a query without an answer, as a full queue does."""
    query.finish()


def test_goal_that_the_queue_dropped_is_sent_again_with_a_new_number(world):
    server, client = world.server(), world.client()
    server.on_goal = drop
    handle = client.send_goal(Fibonacci.Goal(order=1))
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: server.sent)
    server.on_goal = server.accept
    server.wait(lambda: uuid in server.asked)
    assert server.sent == [uuid, uuid]
    assert server.problems == []
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.SUCCEEDED


def test_goal_whose_acceptance_was_lost_is_not_sent_again(world):
    server, client = world.server(), world.client()

    def run_silently(query, uuid):
        server.states[uuid] = 2
        query.finish()

    server.on_goal = run_silently
    handle = client.send_goal(Fibonacci.Goal(order=1))
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: uuid in server.asked)
    world.clock.sleep(10.0)
    server.end(uuid, 4, Fibonacci.Result(sequence=[1]))
    assert handle.wait(5.0)
    assert server.sent == [uuid]
    assert list(handle.get_result().sequence) == [1]


def test_repetition_that_is_refused_is_followed_when_the_server_knows_the_goal(world):
    server, client = world.server(), world.client()
    dropped = []

    def drop_first(query, uuid):
        dropped.append(uuid)
        query.finish()
        server.on_goal = take_silently

    def take_silently(query, uuid):  # the first sending had been late, not lost
        server.states[uuid] = 2
        server.refuse(query, uuid)

    server.on_goal = drop_first
    handle = client.send_goal(Fibonacci.Goal(order=1))
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: uuid in server.asked)
    server.end(uuid, 6)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.ABORTED


def test_result_that_was_not_answered_is_asked_for_again(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    for _ in range(3):
        for question in server.asked.pop(uuid):
            question.finish()
        server.wait(lambda: uuid in server.asked)
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert server.problems == []


def test_server_that_forgot_the_goal_makes_it_lost(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    for question in server.asked.pop(uuid):
        server.answer_result(question, 0)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.LOST
    assert "does not know" in handle.get_goal_status_text()


@pytest.mark.parametrize("broken", [b"", b"\x00\x01\x00\x00", b"\x00\x07\x00\x00" + bytes(20)])
def test_answers_that_cannot_be_read_are_no_answers(world, broken):
    server, client = world.server(), world.client()
    taken = []

    def answer_badly(query, uuid):
        taken.append(uuid)
        server.states[uuid] = 1
        query.reply(broken)
        query.reply_error("so what")
        query.finish()

    server.on_goal = answer_badly
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: taken and taken[0] in server.asked)
    server.status.put(broken, b"")
    server.feedback.put(broken, None)
    server.end(taken[0], 4)
    assert handle.wait(5.0)
    assert len(taken) == 1


def test_many_goals_never_overfill_the_queue_of_a_server(world):
    server, client = world.server(), world.client()
    waiting, most = [], 0

    def take_later(query, uuid):
        nonlocal most
        waiting.append((query, uuid))
        most = max(most, len(waiting))
        world.clock.call_later(0.01, answer_one)

    def answer_one():
        query, uuid = waiting.pop(0)
        server.accept(query, uuid)
        server.end(uuid, 4)

    server.on_goal = take_later

    def answer_late(query, uuid):
        server.answer_result(query, server.states.get(uuid, 0))

    server.on_result = answer_late
    handles = [client.send_goal(Fibonacci.Goal(order=1)) for _ in range(100)]
    assert all(handle.wait(30.0) for handle in handles)
    assert {handle.get_goal_status() for handle in handles} == {Status.SUCCEEDED}
    assert most <= MAX_IN_FLIGHT
    assert len(server.sent) == len(set(server.sent)) == 100


def test_goals_that_end_before_their_acceptance_arrives_make_room_for_others(world):
    server, client = world.server(), world.client()

    def end_first(query, uuid):
        server.set_state(uuid, 2)
        server.end(uuid, 4)
        world.clock.call_later(10.0, lambda: server.reply(query, pack_accepted(1)))

    server.on_goal = end_first
    server.on_result = lambda query, uuid: server.answer_result(query, server.states.get(uuid, 0))
    handles = [client.send_goal(Fibonacci.Goal(order=1)) for _ in range(5 * MAX_IN_FLIGHT)]
    assert all(handle.wait(5.0) for handle in handles)
    assert len(server.sent) == len(handles)


# -- cancels ---------------------------------------------------------------------------------------


def test_cancel_names_one_goal_and_is_told_by_the_list(world):
    server, client = world.server(), world.client()
    handle, uuid, states = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(0.1)
    handle.cancel()
    server.wait(lambda: server.states[uuid] == 3)
    server.end(uuid, 5)
    assert handle.wait(5.0)
    assert server.cancels == [(uuid, 0)]
    assert handle.get_goal_status() == Status.PREEMPTED
    assert "PREEMPTING" in states


def test_refused_cancel_with_code_0_leaves_the_goal_running(world):
    server, client = world.server(), world.client()
    server.on_cancel = server.refuse_cancel
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    handle.cancel()
    world.clock.sleep(30.0)
    assert server.cancels == [(uuid, 0)]
    assert handle.get_comm_state() == CommState.WAITING_FOR_CANCEL_ACK
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.SUCCEEDED


def test_cancel_of_a_goal_that_waits_for_its_answer_follows_the_acceptance(world):
    server, client = world.server(), world.client()
    kept = []
    server.on_goal = lambda query, uuid: kept.append((query, uuid))
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: kept)
    handle.cancel()
    world.clock.sleep(5.0)
    assert server.cancels == []
    server.accept(*kept[0])
    uuid = kept[0][1]
    server.wait(lambda: server.states[uuid] == 3)
    server.end(uuid, 5)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.RECALLED
    assert server.sent == [uuid]


def test_cancel_that_comes_just_before_its_goal_recalls_it(world, monkeypatch):
    """Another thread cancels when the goal is followed already and not sent yet."""
    server, client = world.server(), world.client()
    port = client.manager.port
    send = port.send_goal

    def send_goal(*args, **options):
        monkeypatch.undo()
        client.cancel_all_goals()
        world.clock.sleep(0.01)
        send(*args, **options)

    monkeypatch.setattr(port, "send_goal", send_goal)
    handle = client.send_goal(Fibonacci.Goal(order=1))
    assert handle.wait(60.0)
    assert handle.get_goal_status() == Status.RECALLED
    assert server.sent == []


def test_cancel_of_all_goals(world):
    server, client = world.server(), world.client()
    first, one, _ = begin(server, client)
    second, two, _ = begin(server, client)
    client.cancel_all_goals()
    server.wait(lambda: {server.states[one], server.states[two]} == {3})
    server.end(one, 5)
    server.end(two, 5)
    assert first.wait(5.0)
    assert second.wait(5.0)
    assert server.cancels[0] == (bytes(16), 0)


# -- servers that die, return, do not fit ----------------------------------------------------------


def test_goals_of_a_server_that_dies_are_lost_at_once(world):
    server, client = world.server(), world.client()
    handle, _, _ = begin(server, client)
    start = world.clock.now()
    world.robot.kill()
    assert handle.wait(5.0)
    assert world.clock.now() - start < 0.05
    assert handle.get_goal_status() == Status.LOST
    assert "node 'robot'" in handle.get_goal_status_text()


def test_last_answer_of_a_server_that_leaves_may_come_after_its_tokens_went(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    for end in server.ends:
        end.close()
    world.clock.sleep(0.01)
    server.end(uuid, 6)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.ABORTED
    world.clock.sleep(0.1)
    assert not client.wait_for_server(0.1)


def test_goal_outlives_a_lost_link_within_the_time_given(world):
    server, client = world.server(), world.client(server_lost_timeout=300.0)
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(0.1)
    world.link.cut(100.0)
    world.clock.sleep(90.0)
    server.asked.clear()
    server.end(uuid, 4)
    server.on_result = lambda query, _: server.answer_result(
        query, 4, Fibonacci.Result(sequence=[1])
    )
    assert handle.wait(60.0)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert server.sent == [uuid]
    assert server.problems == []


def test_goal_whose_answer_a_lost_link_took_is_settled_not_sent_again(world):
    server, client = world.server(), world.client(server_lost_timeout=300.0)
    server.on_goal = lambda query, uuid: server.states.update({uuid: 2})
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: server.sent)
    world.link.cut(100.0)
    world.clock.sleep(110.0)
    uuid = server.sent[0]
    server.wait(lambda: uuid in server.asked)
    server.end(uuid, 4)
    assert handle.wait(60.0)
    assert server.sent == [uuid]


def test_goal_that_ran_and_was_forgotten_while_the_link_was_lost_does_not_run_again(world):
    server = world.server()
    server.publish_states()  # a probe asks for this list
    client = world.client(world.node(world.link, probe=0.5), server_lost_timeout=300.0)
    server.on_goal = lambda query, uuid: None
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: server.sent)
    world.link.cut(3.0)
    assert handle.wait(60.0)
    assert handle.get_goal_status() == Status.LOST
    assert "may or may not have run" in handle.get_goal_status_text()
    assert len(server.sent) == 1


def test_doubt_that_outlasts_what_a_server_remembers_ends_as_lost(world):
    server, client = world.server(), world.client(server_lost_timeout=300.0)
    server.on_goal = lambda query, uuid: None
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: server.sent)
    world.link.cut(70.0 + SETTLED_S)
    assert handle.wait(200.0)
    assert handle.get_goal_status() == Status.LOST
    assert "may or may not have run" in handle.get_goal_status_text()
    assert len(server.sent) == 1


def test_server_with_another_definition_is_told_with_both_hashes(world):
    world.server(action=NavigateToPose, distro="rolling")
    client = ActionClient("fib", NavigateToPose, node=world.mission)
    with pytest.raises(TypeMismatchError) as caught:
        client.wait_for_server(5.0)
    assert str(caught.value).count("RIHS01_") == 2
    assert "'rolling'" in str(caught.value)
    assert caught.value.expected_md5 != caught.value.found_md5


def test_other_domain_is_another_network(world):
    world.server(domain=7)
    client = ActionClient("fib", Fibonacci, node=world.mission)
    assert not client.wait_for_server(1.0)
    there = SimpleActionClient("fib", Fibonacci, node=world.node(world.session(), domain=7))
    assert there.wait_for_server(1.0)


def test_server_that_comes_late_gets_the_goal(world):
    client = ActionClient("fib", Fibonacci, node=world.mission)
    handle = client.send_goal(Fibonacci.Goal(order=1))
    world.clock.sleep(100.0)
    server = world.server(show=False)
    world.clock.sleep(10.0)
    assert server.sent == []
    server.show()
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: uuid in server.asked)
    server.end(uuid, 4)
    assert handle.wait(5.0)


def test_goal_is_found_again_by_its_id(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    goal_id = handle.get_goal_id()
    client.stop()
    later = world.client(world.node(world.session()))
    again = later.attach(goal_id)
    server.wait(lambda: len(server.asked[uuid]) == 2)
    world.clock.sleep(1.0)
    assert again.get_comm_state() == CommState.ACTIVE
    server.end(uuid, 4, Fibonacci.Result(sequence=[3]))
    assert again.wait(5.0)
    assert list(again.get_result().sequence) == [3]
    unknown = later.attach("no-such-goal")
    assert unknown.wait(5.0)
    assert unknown.get_goal_status() == Status.LOST


# -- a silent link ---------------------------------------------------------------------------------


def test_silent_link_is_noticed_by_the_probe_long_before_the_lease(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(0.1)
    world.link.cut()
    start = world.clock.now()
    assert handle.wait(59.0)
    assert world.clock.now() - start < 10.0
    assert handle.get_goal_status() == Status.LOST
    assert "has not been heard for" in handle.get_goal_status_text()


def test_busy_server_whose_link_is_there_is_left_in_peace(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    requests = len(server._seen)
    world.clock.sleep(300.0)  # it says nothing, and nothing is asked of its executor
    assert handle.get_comm_state() == CommState.ACTIVE
    assert len(server._seen) == requests
    server.end(uuid, 4)
    assert handle.wait(5.0)


def test_silent_server_that_is_heard_again_gets_its_goals_back(world):
    server, client = world.server(), world.client(server_lost_timeout=100.0)
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(0.1)
    world.link.cut(20.0)
    world.clock.sleep(15.0)
    assert not client.wait_for_server(0.1)
    world.clock.sleep(15.0)
    assert client.wait_for_server(1.0)
    server.wait(lambda: len(server.asked[uuid]) == 2)
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert server.sent == [uuid]


class StoppedOnce:
    """The clock of a process that stands still for 60 s after its first probe: SIGSTOP, a debugger."""

    def __init__(self, clock):
        self.now, self.spawn = clock.now, clock.spawn
        self._clock = clock
        self._delays = iter((0.0, 60.0))

    def call_later(self, delay, step):
        return self._clock.call_later(max(delay, next(self._delays, 0.0)), step)


def test_probe_that_waited_for_a_full_link_is_judged_after_it_was_sent(clock):
    """Nobody could answer it before: a server was lost that was there."""
    silent, sent = [], []

    def ask():
        clock.sleep(5.0)
        sent.append(clock.now())
        clock.call_later(0.5, probe.note_received)
        return contextlib.ExitStack()

    probe = LinkProbe(clock, 5.0, ask, lambda: True, silent.append)
    probe.watch()
    clock.sleep(30.0)
    probe.close()
    assert len(sent) > 1
    assert silent == []


def test_link_is_probed_again_after_a_probe_that_raised(clock, monkeypatch):
    told, asked, silent = [], [], []
    monkeypatch.setattr(threading, "excepthook", lambda args: told.append(args.exc_type))

    def ask():
        asked.append(clock.now())
        if len(asked) == 1:
            raise ValueError
        probe.note_received()
        return contextlib.ExitStack()

    probe = LinkProbe(clock, 5.0, ask, lambda: True, silent.append)
    probe.watch()
    clock.sleep(30.0)
    probe.close()
    assert len(asked) > 1
    assert told == [ValueError]


@pytest.mark.parametrize("answered", [{1}, {2}, set()])
def test_process_that_stood_still_after_a_probe_judges_by_the_next_one(clock, answered):
    asked, silent = [], []

    def ask():
        asked.append(clock.now())
        if len(asked) in answered:
            probe.note_received()
        return contextlib.ExitStack()

    probe = LinkProbe(StoppedOnce(clock), 5.0, ask, lambda: True, silent.append)
    probe.watch()
    clock.sleep(68.0)
    probe.close()
    second = 70.0 if 1 in answered else 65.0
    assert asked == [pytest.approx(at) for at in (5.0, second) if at < 68.0]
    assert silent == ([] if answered else [pytest.approx(67.0)])


class SlowClock(StoppedOnce):
    """The clock of a busy process: whatever is due comes this much later [s]."""

    def __init__(self, clock, late):
        super().__init__(clock)
        self._delays = itertools.repeat(late)

    def call_later(self, delay, step):
        return self._clock.call_later(delay + next(self._delays), step)


@pytest.mark.parametrize(("late", "asks"), [(1.0, 1), (30.0, 2)])
def test_process_that_is_late_each_time_judges_by_the_second_probe_at_the_latest(clock, late, asks):
    asked, silent = [], []

    def ask():
        asked.append(clock.now())
        return contextlib.ExitStack()

    probe = LinkProbe(SlowClock(clock, late), 0.1, ask, lambda: True, silent.append)
    probe.watch()
    while not silent:
        clock.sleep(1.0)
    probe.close()
    assert len(asked) == asks


def test_look_that_rounding_makes_come_too_early_lets_time_pass(clock):
    asked = []

    def ask():
        asked.append(clock.now())
        return contextlib.ExitStack()

    probe = LinkProbe(clock, 5.0, ask, lambda: True, asked.append)
    clock.sleep(26.5)
    probe.watch()
    clock.sleep(4.8)
    probe.note_received()
    assert clock.now() + 0.2 + (5.0 - 0.2) - probe.last_received < 5.0
    clock.sleep(5.5)
    probe.close()
    assert asked == [pytest.approx(36.3)]


def test_probe_can_be_left_out(world):
    server, client = world.server(), world.client(world.node(world.link, probe=0.0))
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(0.1)
    world.link.cut()
    assert not handle.wait(50.0)
    assert handle.wait(20.0)
    assert handle.get_goal_status() == Status.LOST


# -- the graph -------------------------------------------------------------------------------------


def test_client_shows_its_node_and_five_ends_and_takes_them_back(world):
    looker = RosNode(world.session(), world.clock, domain=0, full_name="looker")
    client = ActionClient("fib", Fibonacci, node=world.mission)
    tokens = [token for token in looker.list() if token.kind is not Kind.SERVICE]  # parameters
    assert sorted(token.kind for token in tokens) == sorted(
        [Kind.NODE, *3 * [Kind.CLIENT], *2 * [Kind.SUBSCRIPTION]]
    )
    assert {token.node for token in tokens} == {"mission"}
    client.stop()
    assert {token.kind for token in looker.list()} == {Kind.NODE, Kind.SERVICE}


def test_closed_client_leaves_no_question_open(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    client.stop()
    assert handle.get_comm_state() == CommState.LOST
    server.end(uuid, 4)
    world.clock.sleep(1.0)
    assert handle.get_result() is None


# -- names of ROS 1's types ------------------------------------------------------------------------


def test_client_of_move_base_drives_by_navigate_to_pose(world):
    server = Ros2Server(world.robot, world.clock, "navigate_to_pose", NavigateToPose)
    node = world.node(world.session(), names=("move_base",))
    client = ActionClient("move_base", MoveBaseAction, node=node)
    assert client.wait_for_server(5.0)
    seen = []
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.pose.position.x = 3.5
    handle = client.send_goal(goal, None, lambda _, feedback: seen.append(feedback))
    uuid = goal_uuid(handle.get_goal_id())
    server.wait(lambda: uuid in server.asked)
    got = server.goals[uuid]
    assert (got.pose.header.frame_id, got.pose.pose.position.x) == ("map", 3.5)
    feedback = NavigateToPose.Feedback()
    feedback.current_pose.pose.position.x = 1.5
    server.publish_feedback(uuid, feedback)
    world.clock.sleep(0.1)
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert [message.base_position.pose.position.x for message in seen] == [1.5]
    assert handle.get_result() == MoveBaseResult()


def test_question_for_the_result_of_a_long_goal_is_asked_again(world):
    server, client = world.server(), world.client()
    handle, uuid, _ = begin(server, client)
    server.set_state(uuid, 2)
    world.clock.sleep(3 * ANSWER_S)
    assert 3 <= len(server.asked[uuid]) <= 4
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert server.sent == [uuid]
    assert server.problems == []


def test_requests_of_many_goals_do_not_stay_for_long(world, monkeypatch):
    """Each stayed in Zenoh's memory for ten minutes: 100 goals a second held 90 MB."""
    monkeypatch.setattr("actionlib_core.wire.ros2.network.MANY", 20)
    server, client = world.server(), world.client()
    query, waits = world.mission.transport.query, []

    def noting(*args, timeout, **kwargs):
        waits.append(timeout)
        return query(*args, timeout=timeout, **kwargs)

    network = ros_network(world.mission, "fib")
    monkeypatch.setattr(network.transport, "query", noting)
    monkeypatch.setattr(network, "_asked", deque(maxlen=20))

    def run_goals(count):
        for _ in range(count):
            handle, uuid, _ = begin(server, client)
            server.end(uuid, 4)
            assert handle.wait(5.0)

    run_goals(15)
    assert waits == [ANSWER_S] * 20 + [MIN_ANSWER_S] * 10
    world.clock.sleep(ANSWER_S + 1.0)
    waits.clear()
    run_goals(1)
    assert waits == [ANSWER_S] * 2


def test_who_waits_for_a_server_is_told_once_where_it_was_looked_for(world, caplog):
    world.server(domain=7)
    client = ActionClient("fib", Fibonacci, node=world.mission)
    start = world.clock.now()
    assert not client.wait_for_server(20.0)
    assert world.clock.now() - start == pytest.approx(20.0)
    (record,) = [r for r in caplog.records if "no server after" in r.message]
    assert "Try --domain 7" in record.message
    caplog.clear()
    assert not client.wait_for_server(2.0)
    assert caplog.records == []


def test_link_that_falls_silent_before_the_first_status_is_noticed(world):
    server, client = world.server(), world.client()
    server.on_goal = lambda query, uuid: None
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: server.sent)
    world.link.cut(50.0)
    assert handle.wait(15.0)
    assert handle.get_goal_status() == Status.LOST
    assert "has not been heard" in handle.get_goal_status_text()
    assert server.problems == []


def test_server_that_thinks_about_its_first_goal_is_asked_for_life_and_left_in_peace(world):
    server, client = world.server(), world.client()
    kept = []
    server.on_goal = lambda query, uuid: kept.append((query, uuid))
    handle = client.send_goal(Fibonacci.Goal(order=1))
    server.wait(lambda: kept)
    world.clock.sleep(100.0)
    assert not handle.wait(0.1)
    assert 5 <= len(server._seen) - 1 <= 20
    server.accept(*kept[0])
    uuid = kept[0][1]
    server.wait(lambda: uuid in server.asked)
    server.end(uuid, 4)
    assert handle.wait(5.0)
    assert server.sent == [uuid]
    assert server.problems == []


def test_suspended_server_is_asked_for_life_once(world):
    server, client = world.server(), world.client()
    asked = []
    server.on_goal = lambda query, uuid: None
    server.on_result = lambda query, uuid: asked.append(query)
    handle = client.send_goal(Fibonacci.Goal(order=1))
    assert handle.wait(60.0)
    assert handle.get_goal_status() == Status.LOST
    world.clock.sleep(60.0)
    assert len(asked) <= 2  # for life, and for the goal
    for query in asked:
        server.answer_result(query, 0)
    assert client.wait_for_server(1.0)
