"""Goals that their clients want to be cancelled if they die: `cancel_on_client_lost`."""

from __future__ import annotations

import pytest

from actionlib_core import ActionClient, SimpleActionClient, SimpleActionServer
from actionlib_core.interfaces.actionlib import msg

LONG_S = 60.0
BOTH = [True, False]


class Digger:
    """A server whose goals run until they are asked to stop."""

    def __init__(self, world):
        self.started, self.asked = world.event(), world.event()
        self.server = SimpleActionServer(
            "dig", msg.TestAction, self.dig, node=world.node("digger"), auto_start=False
        )
        self.server.register_preempt_callback(self.asked.set)
        self.server.start()

    def dig(self, _goal):
        self.started.set()
        self.asked.wait(LONG_S)
        self.server.set_preempted(text="stopped")


def send_simple(client, **options):
    client.send_goal(msg.TestGoal(1), **options)


def send_full(client, **options):
    client.action_client.send_goal(msg.TestGoal(1), **options)


def send_block(client, **options):
    client.action_client.send(msg.TestGoal(1), **options)


@pytest.mark.parametrize("send", [send_simple, send_full, send_block])
@pytest.mark.parametrize("wanted", BOTH)
def test_a_client_that_dies_takes_its_goal_with_it_if_it_wants_so(world, send, wanted):
    digger = Digger(world)
    client = SimpleActionClient("dig", msg.TestAction, node=world.node("client"))
    assert client.wait_for_server(LONG_S)
    send(client, cancel_on_client_lost=wanted)
    assert digger.started.wait(LONG_S)
    client.action_client.node.transport.close()
    assert digger.asked.wait(LONG_S if wanted else 0.2) is wanted
    digger.asked.set()


def test_only_the_goals_that_want_it(world):
    digger = Digger(world)
    clients = [ActionClient("dig", msg.TestAction, node=world.node(n)) for n in ("one", "two")]
    for client in clients:
        assert client.wait_for_server(LONG_S)
    stays = clients[0].send_goal(msg.TestGoal(1), cancel_on_client_lost=True)
    assert digger.started.wait(LONG_S)
    clients[1].node.transport.close()  # it has no goal
    assert not digger.asked.wait(0.2)
    digger.asked.set()
    assert stays.wait(LONG_S)


def test_a_goal_that_is_repeated_until_its_server_appears_still_wants_it(world):
    client = SimpleActionClient("dig", msg.TestAction, node=world.node("client"))
    send_simple(client, cancel_on_client_lost=True)
    digger = Digger(world)
    assert digger.started.wait(LONG_S)
    client.action_client.node.transport.close()
    assert digger.asked.wait(LONG_S)


def test_a_goal_that_is_followed_again_before_its_server_appears_still_wants_it(world):
    client = SimpleActionClient("dig", msg.TestAction, node=world.node("client"))
    send_simple(client, cancel_on_client_lost=True)
    goal_id = client.gh.get_goal_id()
    client.stop_tracking_goal()
    client.attach(goal_id)
    digger = Digger(world)
    assert digger.started.wait(LONG_S)
    client.action_client.node.transport.close()
    assert digger.asked.wait(LONG_S)
