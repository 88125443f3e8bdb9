"""Parameters and life cycle of a node of a ROS 2 robot, which a few services stand for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actionlib_core.config import Config, Ros2
from actionlib_core.exceptions import (
    InvalidDurationError,
    NodeError,
    RemoteNodeError,
    ServiceUnavailableError,
    WaitTimeoutError,
)
from actionlib_core.interfaces import ros2
from actionlib_core.node import Node
from actionlib_core.pubsub.remote_node import (
    RemoteNode,
    parameter_value,
    value_of,
)
from actionlib_core.pubsub.service import Service
from actionlib_core.transport.memory import MemoryNetwork

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.clock import VirtualClock

CONFIG = Config(ros2=(Ros2(domain=42, distro="kilted"),))
MOVES = {
    ("unconfigured", "configure"): "inactive",
    ("inactive", "activate"): "active",
    ("active", "deactivate"): "inactive",
    ("inactive", "cleanup"): "unconfigured",
    ("inactive", "shutdown"): "finalized",
}
NUMBERS = {"configure": 1, "cleanup": 2, "activate": 3, "deactivate": 4, "shutdown": 0}

make_value = ros2.get_message("rcl_interfaces/ParameterValue", "kilted")
int64 = st.integers(-(2**63), 2**63 - 1)
floats = st.floats(allow_nan=False)
lists = st.one_of(*(st.lists(k, min_size=1) for k in (st.booleans(), int64, floats, st.text("aä"))))
values = st.one_of(st.booleans(), int64, floats, st.text("aä "), st.binary(), lists)


class Robot:
    """A managed node with parameters, as rclcpp answers for it."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock, self.network = clock, MemoryNetwork(clock)
        self.parameters: dict[str, Any] = {"speed": 0.5, "plugins": ["a", "b"], "debug": False}
        self.label = "unconfigured"
        self.nodes = [self.node("robot")]
        for name, kind, answer in (
            ("get_parameters", "rcl_interfaces/GetParameters", self.get),
            ("set_parameters", "rcl_interfaces/SetParameters", self.set),
            ("list_parameters", "rcl_interfaces/ListParameters", self.list),
            ("get_state", "lifecycle_msgs/GetState", self.state),
            ("change_state", "lifecycle_msgs/ChangeState", self.change),
        ):
            service = ros2.get_service(kind, "kilted")
            Service(f"controller/{name}", service, self.bound(answer, service), node=self.nodes[0])
        self.nodes.append(self.node("mission"))

    @staticmethod
    def bound(answer: Any, service: Any) -> Any:
        return lambda request: answer(request, service.Response())

    def node(self, name: str) -> Node:
        return Node(name, transport=self.network.session(), clock=self.clock, config=CONFIG)

    def get(self, request: Any, response: Any) -> Any:
        if set(request.names) <= set(self.parameters):
            response.values = [
                parameter_value(self.parameters[name], make_value) for name in request.names
            ]
        return response

    def set(self, request: Any, response: Any) -> Any:
        result = ros2.get_message("rcl_interfaces/SetParametersResult", "kilted")
        for parameter in request.parameters:
            known = parameter.name in self.parameters
            if known:
                self.parameters[parameter.name] = value_of(parameter.value)
            reason = "" if known else "not declared"
            response.results = [*response.results, result(successful=known, reason=reason)]
        return response

    def list(self, request: Any, response: Any) -> Any:
        response.result.names = [
            name
            for name in self.parameters
            if not request.prefixes or name.startswith(tuple(request.prefixes))
        ]
        return response

    def state(self, request: Any, response: Any) -> Any:
        response.current_state.label = self.label
        return response

    def change(self, request: Any, response: Any) -> Any:
        transition = request.transition
        after = MOVES.get((self.label, transition.label))
        response.success = after is not None and NUMBERS[transition.label] == transition.id
        self.label = after or self.label
        return response


@pytest.fixture
def robot(clock: VirtualClock) -> Iterator[Robot]:
    robot = Robot(clock)
    yield robot
    for node in reversed(robot.nodes):
        node.close()
        node.transport.close()


@pytest.fixture
def remote(robot: Robot) -> RemoteNode:
    return RemoteNode("controller", node=robot.nodes[1])


def test_parameters_are_read_set_and_listed(robot: Robot, remote: RemoteNode) -> None:
    assert remote.get_parameters("speed", "plugins") == {"speed": 0.5, "plugins": ["a", "b"]}
    remote.set_parameters({"speed": 0.25, "debug": True})
    assert robot.parameters == {"speed": 0.25, "plugins": ["a", "b"], "debug": True}
    assert remote.list_parameters() == ["debug", "plugins", "speed"]
    assert remote.list_parameters("sp") == ["speed"]


def test_all_missing_and_refused_parameters_are_named_at_once(
    robot: Robot, remote: RemoteNode
) -> None:
    with pytest.raises(RemoteNodeError) as caught:
        remote.get_parameters("speed", "nothing", "neither")
    assert set(caught.value.problems) == {"nothing", "neither"}
    assert caught.value.node == "controller"
    with pytest.raises(RemoteNodeError) as caught:
        remote.set_parameters({"speed": 1.0, "nothing": 1, "neither": 2})
    assert caught.value.problems == {"nothing": "not declared", "neither": "not declared"}
    assert robot.parameters["speed"] == 1.0


def test_a_value_that_no_parameter_has_is_not_sent(robot: Robot, remote: RemoteNode) -> None:
    with pytest.raises(RemoteNodeError) as caught:
        remote.set_parameters({"speed": None, "plugins": [1, "a"], "debug": True})
    assert set(caught.value.problems) == {"speed", "plugins"}
    assert robot.parameters["debug"] is False


def test_the_life_cycle(robot: Robot, remote: RemoteNode) -> None:
    assert remote.state() == "unconfigured"
    remote.change_state("configure")
    remote.change_state("activate")
    assert remote.state() == "active"
    with pytest.raises(RemoteNodeError) as caught:
        remote.change_state("configure")
    assert "'active'" in caught.value.problems["configure"]
    with pytest.raises(RemoteNodeError) as caught:
        remote.change_state("fly")
    assert set(caught.value.problems) == {"fly"}
    for transition in ("deactivate", "shutdown"):
        remote.change_state(transition)
    assert remote.state() == "finalized"


def test_a_node_that_is_not_there(robot: Robot) -> None:
    nobody = RemoteNode("nobody", timeout=1.0, node=robot.nodes[1])
    with pytest.raises(ServiceUnavailableError):
        nobody.get_parameters("speed")
    with pytest.raises(InvalidDurationError):
        RemoteNode("nobody", timeout=-1.0, node=robot.nodes[1])


@pytest.mark.slow
@given(values)
def test_every_value_survives(value: Any) -> None:
    assert value_of(parameter_value(value, make_value)) == value


@pytest.mark.parametrize("value", [None, [], [1, "a"], [True, 1], 2**63, {}, [[1]], object()])
def test_values_that_no_parameter_has(value: Any) -> None:
    with pytest.raises(ValueError, match="expected a bool"):
        parameter_value(value, make_value)


def test_a_value_that_is_not_set_is_none() -> None:
    assert value_of(make_value()) is None
    assert value_of(make_value(type=77)) is None


def test_it_is_waited_for(robot: Robot) -> None:
    nobody = RemoteNode("nobody", timeout=None, node=robot.nodes[1])
    with pytest.raises(WaitTimeoutError, match="/nobody/get_parameters: no server"):
        nobody.wait(3.0)
    with pytest.raises(WaitTimeoutError, match="/nobody/get_state: no server"):
        nobody.wait(0, managed=True)
    RemoteNode("controller", node=robot.nodes[1]).wait(None)


def test_close_ends_running_and_later_calls(robot: Robot, remote: RemoteNode) -> None:
    nobody = RemoteNode("nobody", timeout=None, node=robot.nodes[1])
    robot.clock.call_later(2.0, nobody.close)
    with pytest.raises(NodeError):
        nobody.wait()
    assert robot.clock.now() == 2.0
    remote.close()
    remote.close()
    with pytest.raises(NodeError):
        remote.get_parameters("speed")
