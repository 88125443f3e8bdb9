"""The link to everybody is lost: no text says that a server is gone, which may still be running."""

from __future__ import annotations

import os

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer
from actionlib_core.clock import RealClock, VirtualClock, use_clock
from actionlib_core.config import Config
from actionlib_core.exceptions import ServiceLostError, ServiceUnavailableError, WaitTimeoutError
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.ros2.example_interfaces.action import Fibonacci
from actionlib_core.interfaces.std_srvs.srv import Trigger
from actionlib_core.node import Node, use_node
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.transport.faulty import FaultyTransport
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.transport.zenoh import ZenohTransport
from smachpy import SimpleActionState, StateMachine
from tests.free_port import free_port

LEASE_S = 2.0
TYPES = {"own": (msg.TestAction, msg.TestGoal), "ros2": (Fibonacci, Fibonacci.Goal)}
LOST = "the link to the network is lost, and with it the action server of node 'robot' "


class World:
    """A robot and a mission, each with a link that can be cut."""

    def __init__(self, clock, wire):
        self.clock = clock
        self.action, self.goal = TYPES[wire]
        network = MemoryNetwork(clock)
        self.links = {
            name: FaultyTransport(network.session(), clock=clock, lease=LEASE_S)
            for name in ("robot", "mission")
        }
        self.robot, self.mission = (
            Node(name, transport=link, clock=clock) for name, link in self.links.items()
        )
        accept = lambda handle: handle.set_accepted()  # noqa: E731
        self.server = ActionServer("dig", self.action, accept, node=self.robot)

    def client(self, **options):
        client = ActionClient("dig", self.action, node=self.mission, **options)
        assert client.wait_for_server(5.0)
        return client


@pytest.fixture(params=TYPES)
def world(request):
    clock = VirtualClock()
    with clock, use_clock(clock):
        world = World(clock, request.param)
        yield world
        world.mission.close()
        world.robot.close()


@pytest.mark.parametrize("patience", [0.0, 1.0])
def test_goal_is_lost_with_the_link_and_not_with_its_server(world, patience):
    """The text said that the server, which drove on, was gone."""
    sent = world.client(server_lost_timeout=patience).send(world.goal())
    world.clock.sleep(1.0)
    world.links["mission"].cut(60.0)
    world.clock.sleep(LEASE_S + 10.0)
    assert sent.status is Status.LOST
    if world.action is msg.TestAction:  # on ROS 2 the silence is noticed before the lease is over
        assert sent.text.startswith(LOST)
        assert sent.text.endswith("which may still be running")


def test_server_whose_own_link_is_lost_is_gone_for_others(world):
    sent = world.client().send(world.goal())
    world.clock.sleep(1.0)
    world.links["robot"].cut(60.0)
    world.clock.sleep(LEASE_S + 10.0)
    assert sent.status is Status.LOST
    assert "link" not in sent.text


def test_goal_that_nobody_took_names_the_lost_link(world, caplog):
    client = world.client()
    world.links["mission"].cut(60.0)
    world.clock.sleep(LEASE_S + 10.0)
    handle = client.send_goal(world.goal(), ack_timeout=10.0)
    assert handle.wait(60.0)
    assert handle.get_goal_status_text() == (
        "no action server took this goal within 10 s, as the link to the network is lost"
    )
    told = [record.getMessage() for record in caplog.records if "after 3 s" in record.getMessage()]
    assert told == [
        (
            "action 'dig': no server after 3 s: the link to the network is lost, and with it all "
            "servers, which may still be running"
        )
    ]


def test_state_gives_no_advice_to_start_a_server_that_may_be_running(world, caplog):
    with use_node(world.mission):
        world.client()
        state = SimpleActionState("dig", world.action, server_wait_timeout=10.0)
        machine = StateMachine(["succeeded", "aborted", "preempted"], name="M")
        machine.add("DIG", state)
        world.links["mission"].cut(60.0)
        world.clock.sleep(LEASE_S + 10.0)
        assert machine.execute() == "aborted"
    assert "as the link to the network is lost" in caplog.text
    assert "Try starting an action server" not in caplog.text


@pytest.mark.parametrize("world", ["own"], indirect=True)
def test_calls_of_services_name_the_lost_link(world):
    def answer(_):
        world.clock.sleep(60.0)
        return True, ""

    Service("open", Trigger, answer, node=world.robot)
    proxy = ServiceProxy("open", Trigger, timeout=30.0, node=world.mission)
    proxy.wait_for_service(5.0)
    world.clock.call_later(1.0, lambda: world.links["mission"].cut(60.0))
    with pytest.raises(ServiceLostError, match="the link to the network is lost; the server may"):
        proxy()
    with pytest.raises(ServiceUnavailableError, match="The link to the network is lost"):
        proxy()
    with pytest.raises(WaitTimeoutError, match="The link to the network is lost"):
        proxy.wait_for_service(1.0)


@pytest.mark.zenoh
@pytest.mark.parametrize("dies", ["router", "server"])
def test_router_that_goes_away_is_named(dies):
    clock = RealClock()
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    domain = int(os.environ["SMACHPY_DOMAIN"])
    router = ZenohTransport(Config(mode="router", listen=(endpoint,), discovery="off"))
    config = Config(mode="client", connect=(endpoint,), discovery="off", domain=domain)
    robot, mission = (Node(name, config=config, clock=clock) for name in ("robot", "mission"))
    accept = lambda handle: handle.set_accepted()  # noqa: E731
    server = ActionServer("dig", msg.TestAction, accept, node=robot)
    client = ActionClient("dig", msg.TestAction, node=mission)
    assert client.wait_for_server(60.0)
    assert mission.transport.lost_link == ""
    sent = client.send(msg.TestGoal())
    while not sent.accepted:
        clock.sleep(0.01)
    (router if dies == "router" else robot.transport).close()
    assert sent.wait(60.0)
    assert sent.status is Status.LOST
    named = f"the link to router {endpoint} is lost, and with it the action server of node 'robot' "
    assert sent.text.startswith(named) is (dies == "router"), sent.text
    assert mission.transport.lost_link == (f"router {endpoint}" if dies == "router" else "")
    for each in (client.stop, mission.close, server.keeper.status.close, robot.close, router.close):
        each()
