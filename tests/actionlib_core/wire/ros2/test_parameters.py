"""The parameter services of our own nodes, which the tools of ROS 2 ask of every node they see."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.config import Config, Ros2
from actionlib_core.exceptions import RemoteNodeError, ServiceConflictError
from actionlib_core.interfaces import ros2
from actionlib_core.node import Node
from actionlib_core.pubsub.remote_node import RemoteNode
from actionlib_core.pubsub.service import Service
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.wire.ros2.graph import RosNode
from actionlib_core.wire.ros2.names import HASH_NOT_SUPPORTED, Kind, data_key
from actionlib_core.wire.ros2.network import network_of
from actionlib_core.wire.ros2.parameters import SERVICES, answer
from tests.transports import opened

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Reply, Transport
    from actionlib_core.wire.ros2.names import Token

DOMAIN = 42


class World:
    """A node of ours on ROS 2, and one that asks it."""

    def __init__(self, clock: Clock, mission: Transport, robot: Transport, distro: str) -> None:
        self.clock = clock
        self.sessions = mission, robot
        self.settings = Ros2(domain=DOMAIN, distro=distro)  # type: ignore[arg-type]
        config = Config(ros2=(self.settings,))
        self.mission = Node(
            "mission", namespace="fleet", transport=mission, clock=clock, config=config
        )
        self.robot = Node("robot", transport=robot, clock=clock, config=config)
        self.there = network_of(self.mission, self.settings)

    def close(self) -> None:
        for node in (self.robot, self.mission):
            node.close()
        for session in self.sessions:
            session.close()

    def call(self, service: str, **fields: Any) -> Any:
        service_class: Any = ros2.get_service(SERVICES[service], self.settings.distro)
        name = f"/fleet/mission/{service}"
        return ServiceProxy(name, service_class, timeout=20.0, node=self.robot).call(**fields)


@pytest.fixture(params=["memory-virtual", pytest.param("zenoh", marks=pytest.mark.zenoh)])
def world(request: pytest.FixtureRequest) -> Iterator[World]:
    with opened(request.param, 0) as (clock, session):
        world = World(clock, session(), session(), "kilted")
        yield world
        world.close()


def test_a_node_tells_its_one_parameter(world):
    mission = RemoteNode("/fleet/mission", node=world.robot, timeout=20.0)
    assert mission.list_parameters() == ["use_sim_time"]
    assert mission.list_parameters("other") == []
    assert mission.get_parameters("use_sim_time") == {"use_sim_time": False}
    assert list(world.call("get_parameter_types", names=["use_sim_time"]).types) == [1]
    (described,) = world.call("describe_parameters", names=["use_sim_time"]).descriptors
    assert (described.name, described.read_only) == ("use_sim_time", True)
    assert described.description == ""  # as of rclpy's nodes


def test_a_parameter_that_is_not_there_is_answered_with_an_empty_list(world):
    names = ["use_sim_time", "speed"]
    assert world.call("get_parameters", names=names).values == []
    assert list(world.call("get_parameter_types", names=names).types) == []
    assert world.call("describe_parameters", names=names).descriptors == []


def test_a_change_is_refused_with_a_reason(world):
    mission = RemoteNode("/fleet/mission", node=world.robot, timeout=20.0)
    mission.set_parameters({"use_sim_time": False})  # launch files do: it changes nothing
    with pytest.raises(RemoteNodeError) as caught:
        mission.set_parameters({"use_sim_time": True, "speed": 1.0})
    assert set(caught.value.problems) == {"use_sim_time", "speed"}
    assert "read-only" in caught.value.problems["use_sim_time"]
    assert "'speed'" in caught.value.problems["speed"]


def parameter(name: str, **value: Any) -> Any:
    make: Any = ros2.get_message("rcl_interfaces/Parameter", "kilted")
    make_value: Any = ros2.get_message("rcl_interfaces/ParameterValue", "kilted")
    return make(name=name, value=make_value(**value))


@pytest.mark.parametrize(
    ("parameters", "taken"),
    [
        ([], True),
        ([parameter("use_sim_time", type=1)], True),
        ([parameter("use_sim_time", type=1, bool_value=True)], False),
        ([parameter("use_sim_time", type=2)], False),
        ([parameter("use_sim_time", type=1), parameter("", type=77)], False),
    ],
)
def test_several_changes_are_taken_or_refused_together(parameters, taken):
    request = ros2.get_service(SERVICES["set_parameters_atomically"], "kilted").Request()
    request.parameters = parameters
    result = answer("set_parameters_atomically", "kilted", request).result
    assert result.successful is taken
    assert bool(result.reason) is not taken


def test_a_request_that_cannot_be_read_is_answered_with_an_error(world):
    world.call("list_parameters")  # they are there
    service: Any = ros2.get_service(SERVICES["get_parameters"], "kilted")
    key = data_key(DOMAIN, "fleet/mission/get_parameters", service._type, service._rihs01)
    asker = RosNode(world.robot.transport, world.clock, domain=DOMAIN, full_name="asker")
    end = asker.end(Kind.CLIENT, "x", world.there.type(service._type, service._rihs01))
    good, attachment = service.Request(names=["use_sim_time"]).to_cdr(), end.attachment()
    for payload, attached in ((b"", attachment), (good[:-9], attachment), (good, b"x" * 12)):
        replies: list[Reply] = []
        done = world.clock.event()
        asking = world.robot.transport.query(
            key,
            payload,
            attachment=attached,
            timeout=20.0,
            on_reply=replies.append,
            on_done=done.set,
        )
        assert done.wait(20.0)
        asking.close()
        assert [reply.error for reply in replies] == [True]


def test_a_service_of_the_same_name_is_refused_and_the_node_answers_on(world):
    service: Any = ros2.get_service(SERVICES["get_parameters"], "kilted")
    with pytest.raises(ServiceConflictError, match="get_parameters"):
        Service("~get_parameters", service, lambda _: service.Response(), node=world.mission)
    assert [
        value.type for value in world.call("get_parameters", names=["use_sim_time"]).values
    ] == [1]


def test_the_services_leave_with_the_node(world):
    looker = RosNode(world.robot.transport, world.clock, domain=DOMAIN, full_name="looker")
    there: set[str] = set()
    shown, gone = world.clock.event(), world.clock.event()

    def on_token(token: Token, key: str, alive: bool) -> None:
        (there.add if alive else there.discard)(token.name)
        if len(there) == len(SERVICES):
            shown.set()
        elif not there:
            gone.set()

    watch = looker.watch(on_token, kind=Kind.SERVICE)
    assert shown.wait(20.0)
    assert there == {f"fleet/mission/{service}" for service in SERVICES}
    gone.clear()
    world.mission.close()
    assert gone.wait(20.0)
    watch.close()


def test_on_humble_they_have_no_hashes():
    with opened("memory-virtual", 0) as (clock, session):
        world = World(clock, session(), session(), "humble")
        found = world.there.ros.list(kind=Kind.SERVICE)
        assert {token.type_hash for token in found} == {HASH_NOT_SUPPORTED}
        assert world.call("list_parameters").result.names == ["use_sim_time"]
        world.close()
