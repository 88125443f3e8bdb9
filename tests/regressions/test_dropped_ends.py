"""What a program drops lets go of its node and of the network; it stayed until the node closed."""

from __future__ import annotations

import gc
import weakref

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.exceptions import TransportError
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.interfaces.std_msgs.msg import Int32
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.pubsub.topic import Publisher, Subscriber
from tests.two_nodes import TwoNodes


class World(TwoNodes):
    def __init__(self):
        super().__init__()
        self.goals = []
        self.cancelled = []

    def serve(self, seconds=1.0):
        def execute(_goal):
            if server.wait_preempt(seconds):
                self.cancelled.append(True)
                server.set_preempted()
            else:
                server.set_succeeded()

        server = SimpleActionServer(
            "do", Action, execute, False, node=self.robot, on_client_lost="cancel"
        )
        server.start()

    def held(self):
        """What the mission's node and the network keep of it."""
        self.clock.sleep(0.1)
        return len(self.mission._closers), len(self.network._tokens)


@pytest.fixture
def world():
    with World() as world:
        yield world


MADE = {
    "simple client": lambda w: SimpleActionClient("do", Action, node=w.mission),
    "client": lambda w: ActionClient("do", Action, node=w.mission),
    "publisher": lambda w: Publisher("counter", Int32, node=w.mission),
    "proxy": lambda w: ServiceProxy("lamp", Trigger, node=w.mission),
}


@pytest.mark.parametrize("kind", MADE)
def test_dropped_ends_leave_without_the_help_of_the_garbage_collector(world, kind):
    world.serve()
    MADE["proxy"](world)  # what all proxies share stays
    before = world.held()
    gc.disable()
    try:
        for _ in range(20):
            MADE[kind](world)
        assert world.held() == before
    finally:
        gc.enable()


@pytest.mark.parametrize("kind", ["simple client", "client"])
def test_dropped_client_that_has_sent_goals_leaves(world, kind):
    world.serve()
    before = world.held()
    for _ in range(5):
        client = MADE[kind](world)
        assert client.wait_for_server(5.0)
        client.send_goal(Goal(1))
        world.clock.sleep(2.0)
        del client
    assert world.held() == before
    assert not world.cancelled


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["simple client", "client"])
def test_goal_of_a_dropped_client_runs_to_its_end_and_calls_back(world, kind):
    world.serve(seconds=5.0)
    before = world.held()
    told = []
    client = MADE[kind](world)
    assert client.wait_for_server(5.0)
    client.send_goal(Goal(1), lambda *args: told.append(args))
    del client
    gc.collect()
    world.clock.sleep(1.0)
    assert world.held() != before
    world.clock.sleep(9.0)
    assert told
    assert not world.cancelled
    gc.collect()
    told.clear()
    assert world.held() == before


def test_handle_of_a_dropped_client_works(world):
    world.serve(seconds=5.0)
    handle = MADE["client"](world).send_goal(Goal(1))
    world.clock.sleep(1.0)
    handle.cancel()
    assert handle.wait(5.0)
    assert world.cancelled


@pytest.mark.slow
def test_dropped_subscriber_goes_on_and_latched_message_stays(world):
    seen = []
    Subscriber("counter", Int32, lambda message: seen.append(message.data), node=world.mission)
    Publisher("counter", Int32, latch=True, node=world.robot).publish(1)
    gc.collect()
    world.clock.sleep(1.0)
    Subscriber("counter", Int32, lambda message: seen.append(message.data), node=world.mission)
    world.clock.sleep(1.0)
    assert seen == [1, 1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        lambda w: ActionServer("raw", Action, node=w.mission),
        lambda w: SimpleActionServer("raw", Action, lambda _: None, node=w.mission),
        lambda w: Service("lamp", Trigger, lambda _: None, node=w.mission),
        lambda w: Subscriber("counter", Int32, lambda _: None, node=w.mission),
        lambda w: Publisher("counter", Int32, latch=True, node=w.mission),
        lambda w: SimpleActionClient("do", Action, node=w.mission),
    ],
)
def test_what_was_stopped_is_kept_by_nobody(world, make):
    end = make(world)
    stop = next(
        getattr(end, name) for name in ("stop", "unregister", "close") if hasattr(end, name)
    )
    stop()
    del stop
    gone = weakref.ref(end)
    del end
    world.clock.sleep(1.0)
    gc.collect()
    assert gone() is None


def test_what_is_let_go_may_meet_the_end_of_its_node(world):
    failed = world.clock.event("the failed end")

    def close():
        world.mission.close()
        failed.set()
        raise TransportError("do/ack: the session is closed.")

    world.mission.let_go(close)
    assert failed.wait(1.0)
