"""Several servers of a name, servers without a token, strangers, and clocks that are wrong."""

from __future__ import annotations

import logging
from collections import Counter

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import ActionlibError, TypeMismatchError
from actionlib_core.goal.client import STATUS_LIST_TIMEOUT_S
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib.msg import (
    TestAction as Action,
)
from actionlib_core.interfaces.actionlib.msg import (
    TestActionResult as ActionResult,
)
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.actionlib.msg import TestResult as Result
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus, GoalStatusArray
from actionlib_core.node import Node
from actionlib_core.time import Time
from actionlib_core.transport.tokens import Kind, token_key
from actionlib_core.wire import actions
from actionlib_core.wire.actions import (
    pack_report,
    pack_statuses,
    unpack_frame,
    unpack_goal,
)
from actionlib_core.wire.encoding import encoding_of
from actionlib_core.wire.presence import with_age
from tests.two_nodes import TwoNodes

LONG_S = 60.0
YEAR_S = 365 * 86_400


class World(TwoNodes):
    def __init__(self):
        super().__init__()
        self.runs = Counter()
        self.sent = []  # (frame, id) of every goal on the network
        self.robot.transport.subscribe("do/goal", self._note_goal, history=False)

    def _note_goal(self, sample):
        self.sent.append((unpack_frame(sample.payload), unpack_goal(sample.payload)[0]))

    def serve(self, node, seconds=0.0):
        def execute(handle):
            self.runs[handle.get_goal_id().id] += 1
            handle.set_accepted()
            self.clock.call_later(seconds, lambda: handle.set_succeeded(Result(7)))

        return ActionServer("do", Action, execute, node=node)

    def client(self, kind=ActionClient, **options):
        return kind("do", Action, node=self.mission, **options)

    def stranger(self):
        return self.node("stranger").transport


@pytest.fixture
def world():
    with World() as world:
        yield world


# -- two servers -------------------------------------------------------------------------------


@pytest.fixture
def blind(monkeypatch):
    """Servers that do not find each other, as in the moment after they have joined the network."""
    monkeypatch.setattr(actions, "list_endpoints", lambda *_, **__: [])
    monkeypatch.setattr(actions.ActionServerPort, "_meet_server", lambda *_: None)


@pytest.mark.usefixtures("blind")
def test_goals_in_the_overlap_of_two_servers_run_once_at_the_elder(world):
    elder = world.serve(world.robot)
    world.clock.sleep(1.0)
    client = world.client()
    assert client.wait_for_server(LONG_S)
    world.serve(world.node("second"))
    handles = [client.send_goal(Goal(number)) for number in range(20)]
    assert all(handle.wait(LONG_S) for handle in handles)
    assert {handle.get_goal_status() for handle in handles} == {GoalStatus.SUCCEEDED}
    assert set(world.runs.values()) == {1}
    assert len(world.runs) == 20
    assert {frame for frame, _ in world.sent} == {token_key(elder.keeper.port.endpoint)}


@pytest.mark.usefixtures("blind")
def test_copy_that_is_sent_again_keeps_its_first_address(world, monkeypatch):
    """The elder is found after a goal has gone to the younger, whose answer is lost."""
    elder = world.serve(world.robot)
    elder_token = token_key(elder.keeper.port.endpoint)
    world.clock.sleep(1.0)
    client = world.client()
    assert client.wait_for_server(LONG_S)
    client.manager.on_server_gone(elder.keeper.port.endpoint)
    younger = world.serve(world.node("second"))
    younger_token = token_key(younger.keeper.port.endpoint)
    monkeypatch.setattr(younger.keeper.port, "send_status", lambda *_: None)
    monkeypatch.setattr(younger.keeper.port, "send_result", lambda *_, **__: None)
    world.clock.sleep(0.1)
    handle = client.send_goal(Goal(1))
    client.manager.on_server(elder.keeper.port.endpoint, None)
    world.clock.sleep(LONG_S)
    assert {frame for frame, _ in world.sent} == {younger_token} != {elder_token}
    assert len(world.sent) > 1
    assert world.runs[handle.get_goal_id()] == 1


@pytest.mark.usefixtures("blind")
def test_farewell_of_another_server_is_no_proof_that_a_goal_was_not_taken(world, monkeypatch):
    """Both servers hear the cancel; the younger one remembers it for a goal that it never gets."""
    elder = world.serve(world.robot, seconds=LONG_S / 2)
    world.clock.sleep(1.0)
    client = world.client()
    assert client.wait_for_server(LONG_S)
    send_status = elder.keeper.port.send_status
    monkeypatch.setattr(elder.keeper.port, "send_status", lambda *_: None)
    handle = client.send_goal(Goal(1))
    world.clock.sleep(0.1)
    assert world.runs.total() == 1
    younger = world.serve(world.node("second"))
    world.clock.sleep(0.1)
    handle.cancel()
    world.clock.sleep(0.1)
    younger.stop()
    assert not handle.wait(0.0)
    monkeypatch.setattr(elder.keeper.port, "send_status", send_status)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.SUCCEEDED
    assert world.runs.total() == 1


def test_younger_server_gives_way_and_its_goal_is_lost_with_the_reason(world, monkeypatch):
    monkeypatch.setattr(actions, "list_endpoints", lambda *_, **__: [])
    elder = world.serve(world.robot)
    world.clock.sleep(1.0)
    younger = world.serve(world.node("second"))
    world.clock.sleep(0.1)
    assert younger.stopped
    assert not elder.stopped
    client = world.client()
    handle = client.send_goal(Goal(1))
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.SUCCEEDED


# -- a server without a token ------------------------------------------------------------------


class Bridge:
    """Stands for a server: sends its status lists and shows no token."""

    def __init__(self, world):
        self.world = world
        self.transport = world.node("bridge").transport
        self.lists = self.transport.publisher("do/status", encoding_of(GoalStatusArray))
        self.results = self.transport.publisher("do/result", encoding_of(ActionResult))
        self.goals = []
        self.alive = True
        self.transport.subscribe("do/goal", self.take, history=False)
        self.beat()

    def take(self, sample):
        goal_id, stamp_ns, _ = unpack_goal(sample.payload)
        entry = StatusEntry(goal_id, stamp_ns, int(Status.ACTIVE), "")
        if self.alive and entry not in self.goals:
            self.goals.append(entry)

    def beat(self):
        if self.alive:
            self.lists.put(pack_statuses(self.world.clock.time_ns(), self.goals))
            self.world.clock.call_later(0.2, self.beat)


def test_server_without_a_token_is_waited_for_and_used(world):
    client = world.client()
    bridge = Bridge(world)
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(Goal(1))
    world.clock.sleep(1.0)
    (entry,) = bridge.goals
    done = entry._replace(status=int(Status.SUCCEEDED))
    bridge.results.put(pack_report(world.clock.time_ns(), done, Result(5).to_bytes()))
    assert handle.wait(LONG_S)
    assert handle.get_result() == Result(5)
    bridge.alive = False


@pytest.mark.parametrize("timeout_s", [None, 2.0])
def test_goal_of_a_server_without_a_token_is_lost_when_its_lists_stop(world, timeout_s):
    options = {} if timeout_s is None else {"status_list_timeout": timeout_s}
    client = world.client(**options)
    bridge = Bridge(world)
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(Goal(1))
    world.clock.sleep(10.0)
    assert handle.get_goal_status() == GoalStatus.ACTIVE
    bridge.alive = False
    began = world.clock.now()
    assert handle.wait(LONG_S)
    expected_s = STATUS_LIST_TIMEOUT_S if timeout_s is None else timeout_s
    assert world.clock.now() - began == pytest.approx(expected_s, abs=0.3)
    assert handle.get_goal_status() == GoalStatus.LOST
    assert "no status list" in handle.get_goal_status_text()
    assert not client.wait_for_server(0.1)


class Stopped:
    """The clock of a process that stands still until a time (SIGSTOP): its timers run after that."""

    def __init__(self, clock):
        self._clock = clock
        self.until = 0.0

    def __getattr__(self, name):
        return getattr(self._clock, name)

    def call_later(self, delay, step):
        def run():
            left = self.until - self._clock.now()
            if left > 0:
                self._clock.call_later(left, step)
            else:
                step()

        return self._clock.call_later(delay, run)


@pytest.mark.parametrize("heard", [True, False])
def test_process_that_stood_still_loses_a_server_only_if_it_is_not_heard_afterwards(world, heard):
    clock = Stopped(world.clock)
    with Node("stopped", transport=world.network.session(), clock=clock) as node:
        client = ActionClient("do", Action, node=node)
        bridge = Bridge(world)
        assert client.wait_for_server(LONG_S)
        handle = client.send_goal(Goal(1))
        world.clock.sleep(1.0)
        bridge.alive = False  # what it sends is not read meanwhile
        clock.until = world.clock.now() + LONG_S
        world.clock.sleep(LONG_S + 0.5)
        if heard:
            bridge.alive = True
            bridge.beat()
        world.clock.sleep(10.0)
        assert handle.get_goal_status() == (GoalStatus.ACTIVE if heard else GoalStatus.LOST)
        bridge.alive = False
        assert handle.wait(LONG_S)
        node.transport.close()


@pytest.mark.parametrize("heard", [True, False])
def test_process_that_stood_still_takes_an_acknowledgement_that_was_not_read_yet(world, heard):
    """The goal was LOST and cancelled, though a server had taken it in time."""
    clock = Stopped(world.clock)
    with Node("stopped", transport=world.network.session(), clock=clock) as node:
        client = ActionClient("do", Action, node=node)
        bridge = Bridge(world)
        assert client.wait_for_server(LONG_S)
        bridge.alive = False  # what it sends is not read meanwhile
        handle = client.send_goal(Goal(1), ack_timeout=2.0)
        clock.until = world.clock.now() + LONG_S
        world.clock.sleep(LONG_S + 0.5)
        assert handle.get_goal_status() == GoalStatus.PENDING
        if heard:
            stamp_ns = handle.goal.stamp_ns
            taken = StatusEntry(handle.get_goal_id(), stamp_ns, int(Status.ACTIVE), "")
            bridge.goals.append(taken)
            bridge.alive = True
            bridge.beat()
        world.clock.sleep(10.0)
        assert handle.get_goal_status() == (GoalStatus.ACTIVE if heard else GoalStatus.LOST)
        bridge.alive = False
        assert handle.wait(LONG_S)
        node.transport.close()


def test_goal_of_a_bridge_does_not_run_at_a_server_that_appears(world):
    client = world.client()
    bridge = Bridge(world)
    assert client.wait_for_server(LONG_S)
    bridge.take = lambda _: None
    bridge.goals.clear()
    handle = client.send_goal(Goal(1))
    bridge.goals.clear()
    world.serve(world.robot)
    assert handle.wait(LONG_S)
    assert world.runs[handle.get_goal_id()] <= 1
    bridge.alive = False


@pytest.mark.parametrize("kind", [ActionClient, SimpleActionClient])
@pytest.mark.parametrize("timeout", [-1.0, float("nan"), float("inf"), "5 s", None])
def test_status_list_timeout_is_checked(world, kind, timeout):
    with pytest.raises(ActionlibError, match="status_list_timeout"):
        world.client(kind, status_list_timeout=timeout)


# -- strangers ---------------------------------------------------------------------------------


@pytest.mark.parametrize("word", ["result", "status", "farewell"])
def test_what_a_stranger_says_of_a_goal_is_dropped_and_reported_once(world, caplog, word):
    server = world.serve(world.robot, seconds=5.0)
    client = world.client()
    assert client.wait_for_server(LONG_S)
    handle = client.send_goal(Goal(1))
    world.clock.sleep(1.0)
    stranger = world.stranger()
    entry = StatusEntry(handle.get_goal_id(), 0, int(Status.ABORTED), "forged")
    frame = token_key(server.keeper.port.endpoint) if word == "farewell" else ""
    if word == "result":
        port = stranger.publisher("do/result", encoding_of(ActionResult))
        payload = pack_report(1, entry, Result(66).to_bytes())
    else:
        port = stranger.publisher("do/status", encoding_of(GoalStatusArray))
        payload = pack_statuses(1, [entry], frame)
    for _ in range(3):
        port.put(payload)
    world.clock.sleep(1.0)
    assert handle.get_goal_status() == GoalStatus.ACTIVE
    assert handle.wait(LONG_S)
    assert handle.get_result() == Result(7)
    reports = [record for record in caplog.records if stranger.session_id in record.getMessage()]
    assert [record.levelno for record in reports] == [logging.ERROR]


def wrong_token(world):
    """Show the token of a server with another checksum, which came now."""
    node = world.node("other")
    endpoint = node.endpoint(Kind.ACTION_SERVER, "do", Action._type, "0" * 32)
    endpoint = with_age(endpoint, node)
    return node.transport.declare_alive(token_key(endpoint))


def test_token_of_another_type_is_no_error_beside_a_right_one(world):
    world.serve(world.robot)
    client = world.client()
    world.clock.sleep(1.0)
    wrong_token(world)
    world.clock.sleep(1.0)
    handle = client.send_goal(Goal(1))
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.SUCCEEDED


@pytest.mark.usefixtures("blind")
def test_goal_survives_that_a_token_of_another_type_is_found_first(world):
    client = world.client()
    handle = client.send_goal(Goal(1))
    wrong_token(world)
    world.clock.sleep(0.1)
    world.serve(world.robot)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.SUCCEEDED


def test_goal_is_lost_when_the_only_server_has_another_type(world):
    client = world.client()
    handle = client.send_goal(Goal(1))
    wrong_token(world)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == GoalStatus.LOST
    assert "0" * 32 in handle.get_goal_status_text()
    with pytest.raises(TypeMismatchError):
        client.send_goal(Goal(1))


# -- clocks that are wrong ---------------------------------------------------------------------


def simple_pair(world):
    server = SimpleActionServer(
        "do", Action, lambda goal: server.set_succeeded(Result(goal.goal)), False, node=world.robot
    )
    server.start()
    client = world.client(SimpleActionClient)
    assert client.wait_for_server(LONG_S)
    return client


def test_cancel_from_the_future_bricks_no_server(world, caplog):
    client = simple_pair(world)
    ahead = ActionClient("do", Action, node=world.node("laptop"))
    assert ahead.wait_for_server(LONG_S)
    now_s = world.clock.time_ns() / 1e9
    ahead.cancel_goals_at_and_before_time(Time.from_sec(now_s + 10 * YEAR_S))
    world.clock.sleep(0.1)
    assert client.send_goal_and_wait(Goal(1), LONG_S) == GoalStatus.SUCCEEDED
    assert "clock" in caplog.text


def test_goal_from_the_future_does_not_shut_out_later_ones(world, caplog):
    client = simple_pair(world)
    laptop = ActionClient("do", Action, node=world.node("laptop"))
    assert laptop.wait_for_server(LONG_S)
    handle = laptop.make_goal(Goal(1))
    handle.goal.stamp_ns += 10 * YEAR_S * 10**9
    laptop.manager.begin(handle)
    assert handle.wait(LONG_S)
    world.clock.sleep(0.1)
    assert client.send_goal_and_wait(Goal(1), LONG_S) == GoalStatus.SUCCEEDED
    assert "clock" in caplog.text
