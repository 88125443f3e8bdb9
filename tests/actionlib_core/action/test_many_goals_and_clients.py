"""How work grows with clients and goals: counted in messages, decodings and looks, not in time."""

from __future__ import annotations

import gc
from collections import Counter

import pytest

from actionlib_core import ActionClient, ActionServer, SimpleActionClient
from actionlib_core.goal.client import ClientGoal
from actionlib_core.interfaces.actionlib.msg import TestAction, TestGoal, TestResult
from actionlib_core.wire import actions
from tests.two_nodes import TwoNodes


@pytest.fixture
def world():
    with TwoNodes() as world:
        yield world


@pytest.fixture
def counts(monkeypatch):
    counts = Counter()

    def count(owner, name):
        original = getattr(owner, name)

        def counted(*args, **kwargs):
            counts[name] += 1
            return original(*args, **kwargs)

        monkeypatch.setattr(owner, name, counted)

    count(actions, "unpack_report")
    count(actions, "unpack_statuses")
    count(ClientGoal, "tick")
    return counts


def serve(world, on_goal=None):
    def succeed(handle):
        handle.set_accepted()
        handle.set_succeeded(TestResult(1))

    server = ActionServer("dig", TestAction, on_goal or succeed, node=world.robot)
    server.start()
    return server


@pytest.mark.parametrize("clients", [1, 4, 40])
def test_each_result_and_status_list_is_read_once_whatever_the_number_of_clients(
    world, counts, clients
):
    serve(world)
    each = [ActionClient("dig", TestAction, node=world.mission) for _ in range(clients)]
    for client in each:
        assert client.wait_for_server(5.0)
    counts.clear()
    for client in each:
        handle = client.send_goal(TestGoal(1))
        assert handle.wait(5.0)
        world.clock.sleep(0.5)
    assert counts["unpack_report"] == clients
    assert counts["unpack_statuses"] <= 4 * clients  # lists per goal, and one of the robot's acks


def test_clients_of_one_node_have_one_token_and_the_last_takes_it_away(world):
    tokens = "@smachpy/action_client/**"
    first = ActionClient("dig", TestAction, node=world.mission)
    second = SimpleActionClient("dig", TestAction, node=world.mission)
    assert len(world.robot.transport.list_alive(tokens, 1.0)) == 1
    first.stop()
    assert len(world.robot.transport.list_alive(tokens, 1.0)) == 1
    second.action_client.stop()
    world.clock.sleep(0.1)
    assert world.robot.transport.list_alive(tokens, 1.0) == []


def test_stopping_a_client_loses_its_goals_only(world):
    serve(world, lambda handle: handle.set_accepted())
    one, other = (ActionClient("dig", TestAction, node=world.mission) for _ in range(2))
    mine, its = one.send_goal(TestGoal(1)), other.send_goal(TestGoal(2))
    world.clock.sleep(0.5)
    one.stop()
    assert mine.get_goal_status_text() == "the action client was stopped"
    assert not its.goal.over
    with pytest.raises(Exception, match="the client is stopped"):
        one.send_goal(TestGoal(3))
    assert one.wait_for_server(1.0) is False
    assert other.wait_for_server(1.0)


def test_a_client_after_the_last_one_works(world):
    serve(world)
    for _ in range(3):
        client = ActionClient("dig", TestAction, node=world.mission)
        handle = client.send_goal(TestGoal(1))
        assert handle.wait(5.0)
        assert handle.get_result() == TestResult(1)
        client.stop()


def test_a_dropped_client_leaves_when_its_own_goals_are_over(world):
    goals = []
    serve(world, lambda handle: (handle.set_accepted(), goals.append(handle)))
    kept = ActionClient("dig", TestAction, node=world.mission)
    dropped = ActionClient("dig", TestAction, node=world.mission)
    ends = []
    dropped.send_goal(TestGoal(1), lambda handle: ends.append(handle.get_comm_state().name))
    kept.send_goal(TestGoal(2))
    world.clock.sleep(0.5)
    owners = kept.manager._owners
    del dropped
    gc.collect()
    world.clock.sleep(0.5)
    assert len(owners) == 2  # its goal runs
    goals[0].set_succeeded(TestResult(1))
    world.clock.sleep(0.5)
    assert ends[-1] == "DONE"
    assert len(owners) == 1


def test_two_clients_of_one_node_may_follow_one_goal(world):
    goals = []
    serve(world, lambda handle: (handle.set_accepted(), goals.append(handle)))
    one, other = (ActionClient("dig", TestAction, node=world.mission) for _ in range(2))
    sent = one.send_goal(TestGoal(1))
    world.clock.sleep(0.5)
    followed = other.attach(sent.get_goal_id())
    world.clock.sleep(0.5)
    goals[0].set_succeeded(TestResult(7))
    assert sent.wait(5.0)
    assert followed.wait(5.0)
    assert sent.get_result() == followed.get_result() == TestResult(7)
    other.stop()


def test_looks_at_goals_grow_with_their_number_not_with_its_square(world, counts):
    def looks(goals):
        client = ActionClient("dig", TestAction, node=world.mission)
        handles = []
        for _ in range(goals):
            handles.append(client.send_goal(TestGoal(1)))
            world.clock.sleep(0.01)
        counts.clear()
        world.clock.sleep(5.0)
        found = counts["tick"] / goals
        client.stop()
        return found

    serve(world, lambda handle: handle.set_accepted())
    assert looks(100) <= 2.0 * looks(10) + 1.0
