"""Wall clocks that are set, or that differ between computers, change no decision about goals."""

from __future__ import annotations

import itertools
import logging

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import VirtualClock, use_clock, wall_time
from actionlib_core.exceptions import ServerConflictError
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.ros2.example_interfaces.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.time import Time
from actionlib_core.transport.faulty import DELIVERED, FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork
from tests.wall_clock import Computer

STEPS_S = [-3600.0, -60.0, 3600.0]
STEPS = list(itertools.product(["client", "server", "both"], STEPS_S))
TYPES = {"own": (msg.TestAction, msg.TestGoal), "ros2": (Fibonacci, Fibonacci.Goal)}


class Lab:
    """Computers on one network, each with a node and a clock of its own."""

    def __init__(self, clock):
        self.clock = clock
        self.network = MemoryNetwork(clock)
        self.nodes = []

    def node(self, name, *faults, computer=None):
        link = self.network.session()
        if faults:
            link = FaultyTransport(link, *faults, clock=self.clock)
        node = Node(name, transport=link, clock=computer or Computer(self.clock))
        self.nodes.append(node)
        return node

    def serve(self, action=msg.TestAction, *, seconds=0.0, **options):
        """Start a server whose goals take some time."""

        def execute(_goal):
            if server.wait_preempt(seconds):
                server.set_preempted()
            else:
                server.set_succeeded()

        node = self.node("robot")
        server = SimpleActionServer("dig", action, execute, auto_start=False, node=node, **options)
        server.start()
        self.server, self.robot = server, node.clock
        return server

    def client(self, name="desk", kind=ActionClient, action=msg.TestAction, node=None):
        client = kind("dig", action, node=node or self.node(name))
        client.wait_for_server()
        return client


@pytest.fixture
def lab():
    clock = VirtualClock()
    with clock, use_clock(clock):
        lab = Lab(clock)
        yield lab
        for node in reversed(lab.nodes):
            node.close()


@pytest.mark.parametrize("policy", ["preempt", "queue", "reject"])
@pytest.mark.parametrize("wire", TYPES)
@pytest.mark.parametrize(("where", "step"), STEPS)
def test_idle_server_runs_every_goal_after_a_step(lab, where, step, wire, policy):
    action, goal = TYPES[wire]
    lab.serve(action, policy=policy)
    client = lab.client(kind=SimpleActionClient, action=action)
    desk = client.action_client.node.clock
    assert client.send_goal_and_wait(goal()) == Status.SUCCEEDED
    for ahead in (step, 0.0):
        if where in {"client", "both"}:
            desk.ahead = ahead
        if where in {"server", "both"}:
            lab.robot.ahead = ahead
        lab.clock.sleep(1.0)
        assert client.send_goal_and_wait(goal()) == Status.SUCCEEDED


@pytest.mark.parametrize("wire", TYPES)
@pytest.mark.parametrize(("where", "step"), STEPS)
def test_newer_goal_replaces_the_running_and_the_waiting_one_after_a_step(lab, where, step, wire):
    action, goal = TYPES[wire]
    lab.serve(action, seconds=60.0)
    client = lab.client(action=action)
    one = client.send_goal(goal())
    lab.clock.sleep(1.0)
    if where in {"client", "both"}:
        client.node.clock.ahead = step
    if where in {"server", "both"}:
        lab.robot.ahead = step
    two = client.send_goal(goal())
    assert one.wait(5.0)
    assert one.get_goal_status() == Status.PREEMPTED
    lab.clock.sleep(1.0)
    assert two.get_goal_status() == Status.ACTIVE


@pytest.mark.parametrize("behind", [0.05, 5.0, 3600.0])
def test_newest_goal_wins_among_clients_whose_clocks_differ(lab, behind):
    lab.serve(seconds=60.0)
    ahead, late = lab.client("ahead"), lab.client("late")
    late.node.clock.ahead = -behind
    one = ahead.send_goal(msg.TestGoal(1))
    lab.clock.sleep(0.01)
    two = late.send_goal(msg.TestGoal(2))
    assert one.wait(5.0)
    assert one.get_goal_status() == Status.PREEMPTED
    lab.clock.sleep(0.01)
    assert two.get_goal_status() == Status.ACTIVE
    three = ahead.send_goal(msg.TestGoal(3))
    assert two.wait(5.0)
    lab.clock.sleep(0.01)
    assert three.get_goal_status() == Status.ACTIVE


def lose_first_copy(key, number):
    """Lose the first goal that is sent; its repetition comes 0.5 s later."""
    return () if key.endswith("/goal") and number == 0 else DELIVERED


@pytest.mark.parametrize("step", [0.0, *STEPS_S])
@pytest.mark.parametrize("same", [True, False], ids=["same client", "another client"])
def test_older_goal_that_comes_late_is_recalled(lab, same, step):
    """Its first copy was lost; the second must not stop the goal that was sent after it."""
    lab.serve(seconds=60.0)
    first = lab.client("first", node=lab.node("first", lose_first_copy))
    second = first if same else lab.client("second")
    old = first.send_goal(msg.TestGoal(1))
    lab.clock.sleep(0.1)
    first.node.clock.ahead = step
    new = second.send_goal(msg.TestGoal(2))
    assert old.wait(5.0)
    assert old.get_goal_status() == Status.RECALLED
    assert new.get_goal_status() == Status.ACTIVE


def test_goals_that_waited_for_the_server_end_as_those_that_came_at_once(lab):
    """The last one that was sent runs, whatever the clocks of their clients say."""
    clients = [ActionClient("dig", msg.TestAction, node=lab.node(name)) for name in ("one", "two")]
    clients[1].node.clock.ahead = -3600.0
    older = clients[0].send_goal(msg.TestGoal(1))
    lab.clock.sleep(1.0)
    newer = clients[1].send_goal(msg.TestGoal(2))
    lab.clock.sleep(10.0)
    lab.serve(seconds=60.0)
    assert older.wait(5.0)
    assert older.get_goal_status() in {Status.RECALLED, Status.PREEMPTED}
    assert newer.get_goal_status() == Status.ACTIVE


# -- cancels by time ---------------------------------------------------------------------------


@pytest.mark.parametrize("behind", [5.0, 3600.0])
@pytest.mark.parametrize("policy", ["preempt", "queue", "reject"])
def test_cancel_by_time_stops_no_goal_that_is_sent_after_it(lab, policy, behind):
    lab.serve(policy=policy)
    first, late = lab.client("first"), lab.client("late", SimpleActionClient)
    late.action_client.node.clock.ahead = -behind
    first.cancel_goals_at_and_before_time(Time.from_nsec(first.node.clock.time_ns()))
    lab.clock.sleep(1.0)
    assert late.send_goal_and_wait(msg.TestGoal(1)) == Status.SUCCEEDED


@pytest.mark.parametrize("step", STEPS_S)
def test_cancel_of_all_goals_until_now_stops_own_ones_sent_before_a_step(lab, step):
    lab.serve(seconds=60.0)
    client = lab.client()
    handle = client.send_goal(msg.TestGoal(1))
    lab.clock.sleep(1.0)
    client.node.clock.ahead = step
    client.cancel_goals_at_and_before_time(Time.from_nsec(client.node.clock.time_ns()))
    assert handle.wait(5.0)
    assert handle.get_goal_status() == Status.PREEMPTED


@pytest.mark.parametrize("step", STEPS_S)
def test_cancel_by_time_spares_own_goals_that_are_newer_after_a_step(lab, step):
    handles = []
    ActionServer(
        "dig", msg.TestAction, lambda handle: handle.set_accepted(), node=lab.node("robot")
    )
    client = lab.client()
    client.node.clock.ahead = 0.0
    for _ in range(3):
        handles.append(client.send_goal(msg.TestGoal(1)))
        lab.clock.sleep(1.0)
    client.node.clock.ahead = step
    until_ns = client.node.clock.time_ns() - round(1.5e9)  # between the second and the third
    client.manager.cancel_many(until_ns)
    states = [handle.get_comm_state().name for handle in handles]
    assert states == ["WAITING_FOR_CANCEL_ACK", "WAITING_FOR_CANCEL_ACK", "ACTIVE"]


# -- what people read --------------------------------------------------------------------------


def test_step_of_the_clock_is_logged_once(lab, caplog):
    lab.serve()
    client = lab.client(kind=SimpleActionClient)
    desk = client.action_client.node.clock
    for ahead, text in ((-60.0, "was put back by 60.0 s"), (0.0, "was set forward by 60.0 s")):
        caplog.clear()
        desk.ahead = ahead
        for _ in range(3):
            client.send_goal_and_wait(msg.TestGoal(1))
        logged = [record for record in caplog.records if text in record.getMessage()]
        assert [record.levelno for record in logged] == [logging.WARNING]


def test_clock_that_is_not_set_logs_nothing(lab, caplog):
    lab.serve()
    client = lab.client(kind=SimpleActionClient)
    for _ in range(3):
        client.send_goal_and_wait(msg.TestGoal(1))
        lab.clock.sleep(1000.0)
    client.cancel_goals_at_and_before_time(Time.from_nsec(lab.clock.time_ns()))
    assert "clock" not in caplog.text


def test_client_whose_clock_is_ahead_is_reported_once(lab, caplog):
    lab.serve()
    client = lab.client(kind=SimpleActionClient)
    client.action_client.node.clock.ahead = 1.1
    wall_time(client.action_client.node.clock).check()
    caplog.clear()
    for _ in range(3):
        client.send_goal_and_wait(msg.TestGoal(1))
    (record,) = caplog.records
    assert "has a stamp 1.1 s in the future" in record.getMessage()


def test_stamps_of_one_process_increase_though_its_clock_is_put_back(lab):
    """A server in ROS 1 would recall every goal until the clock has caught up."""
    client = lab.client(kind=ActionClient) if lab.serve() else None
    stamps = [client.make_goal(msg.TestGoal(1)).goal.stamp_ns]
    client.node.clock.ahead = -3600.0
    other = lab.client(node=client.node)
    stamps += [each.make_goal(msg.TestGoal(1)).goal.stamp_ns for each in (client, other, client)]
    assert stamps == sorted(set(stamps))


# -- two servers -------------------------------------------------------------------------------


@pytest.mark.parametrize("ahead", STEPS_S)
def test_of_two_servers_that_meet_late_the_older_stays_whatever_the_clocks_say(
    lab, ahead, monkeypatch
):
    monkeypatch.setattr("actionlib_core.wire.actions.list_endpoints", lambda *_, **__: [])
    nodes = [lab.node("older"), lab.node("younger", computer=Computer(lab.clock, ahead))]
    servers = []
    for node in nodes:
        servers.append(ActionServer("dig", msg.TestAction, node=node))
        lab.clock.sleep(1.0)
    assert servers[1].stopped
    assert isinstance(servers[1].error, ServerConflictError)
    assert not servers[0].stopped
