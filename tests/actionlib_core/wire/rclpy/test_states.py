"""States for nodes of ROS 2 and for Nav2 with nodes of rclpy, whose services the test passes on.

Passed on are the bytes. The wire between is not tested here: rclpy comes with Fast DDS only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.interfaces import ros2
from actionlib_core.pubsub.service import Service
from smachpy import CBState, StateMachine
from smachpy.states import RestoreParameters, SetLifecycle, SetParameters, nav2_active
from smachpy.testing import mission_kit
from smachpy.testing.servers import ScriptedEnd

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from smachpy import State
    from tests.actionlib_core.wire.rclpy.conftest import Rclpy

pytestmark = pytest.mark.rclpy

PARAMETERS = {"speed": 0.5, "samples": 3, "open": False, "frame": "odom"}
SERVICES = {
    "/robot/get_parameters": "rcl_interfaces/GetParameters",
    "/robot/set_parameters": "rcl_interfaces/SetParameters",
    "/robot/list_parameters": "rcl_interfaces/ListParameters",
    "/robot/get_state": "lifecycle_msgs/GetState",
    "/robot/change_state": "lifecycle_msgs/ChangeState",
    "/manager/is_active": "std_srvs/Trigger",
}


class PassedOn(ScriptedEnd):
    """The services of a robot of rclpy, in a test's network."""

    rclpy: Rclpy

    def _start(self) -> None:
        for name, kind in SERVICES.items():
            Service(name, ros2.get_service(kind), self._handler(name, kind), node=self.node)

    def _handler(self, name: str, kind: str) -> Callable[[Any], Any]:
        response: Any = ros2.get_service(kind)._response_class
        full = kind.replace("/", "/srv/")

        def handle(request: Any) -> Any:
            answer = self.rclpy.ask("ask_robot", name, full, request.to_cdr().hex())
            return response.from_cdr(bytes.fromhex(answer))

        return handle


class Robot:
    """A robot of rclpy; see `Robot` in its program."""

    def __init__(self, rclpy: Rclpy) -> None:
        self._rclpy = rclpy

    def open(self, *, refused: tuple[str, ...] = (), broken: tuple[str, ...] = ()) -> None:
        self._rclpy.ask("open_robot", PARAMETERS, refused, broken)

    def run(self, machine: Any) -> Any:
        with mission_kit() as kit:
            type("Of", (PassedOn,), {"rclpy": self._rclpy})(kit, "robot", None)
            return kit(machine)

    def bring(self, *states: str) -> list[str]:
        """Bring it to one state after another; return the outcomes."""
        return [self.run(alone(SetLifecycle("robot", each))).outcome for each in states]

    @property
    def parameters(self) -> dict[str, Any]:
        return dict(
            zip(PARAMETERS, self._rclpy.ask("look_at_robot", [*PARAMETERS])[0], strict=True)
        )

    @property
    def state(self) -> str:
        return str(self._rclpy.ask("look_at_robot", [])[1])

    @property
    def questions(self) -> int:
        return int(self._rclpy.ask("look_at_robot", [])[2])


@pytest.fixture
def robot(rclpy: Rclpy) -> Iterator[Robot]:
    """A robot, which the test opens."""
    yield Robot(rclpy)
    rclpy.ask("close_robot")


def alone(state: State) -> StateMachine:
    machine = StateMachine(state.get_registered_outcomes(), name="ALONE")
    machine.add("STATE", state)
    return machine


def test_a_node_is_brought_to_each_state(robot: Robot) -> None:
    robot.open()
    for target in ("active", "unconfigured", "inactive", "active", "inactive", "finalized"):
        assert robot.bring(target) == ["succeeded"]
        assert robot.state == target
    assert robot.bring("finalized", "active") == ["succeeded", "aborted"]


@pytest.mark.parametrize(
    ("transition", "before", "target", "after"),
    [
        ("configure", "unconfigured", "active", "unconfigured"),
        ("activate", "unconfigured", "active", "inactive"),
        ("deactivate", "active", "unconfigured", "active"),
        ("cleanup", "active", "unconfigured", "inactive"),
    ],
)
def test_a_transition_that_the_node_refuses(
    robot: Robot, transition: str, before: str, target: str, after: str, caplog: Any
) -> None:
    robot.open(refused=(transition,))
    assert robot.bring(before, target) == ["succeeded", "aborted"]
    assert robot.state == after
    assert transition in caplog.text


@pytest.mark.parametrize("transition", ["configure", "activate"])
def test_a_transition_that_raises_in_the_node(robot: Robot, transition: str) -> None:
    robot.open(broken=(transition,))
    assert robot.bring("active") == ["aborted"]
    assert robot.state in {"unconfigured", "finalized"}


def test_parameters_are_set_during_the_work_and_set_back(robot: Robot) -> None:
    robot.open()
    slow = {"speed": 0.25, "samples": 7, "open": True, "frame": "map"}
    seen: list[dict[str, Any]] = []
    machine = StateMachine(["done", "aborted", "preempted"], name="M")
    machine.add("SET", SetParameters("robot", slow), {"succeeded": "WORK"})
    machine.add(
        "WORK", CBState(lambda _: seen.append(robot.parameters) or "done", outcomes=["done"])
    )
    machine.add_cleanup("RESTORE", RestoreParameters())
    assert robot.run(machine).outcome == "done"
    assert seen == [slow]
    assert robot.parameters == PARAMETERS


def test_a_parameter_that_the_node_refuses(robot: Robot, caplog: Any) -> None:
    robot.open(refused=("speed",))
    assert robot.run(alone(SetParameters("robot", {"speed": 9.0}))).outcome == "aborted"
    assert "too fast" in caplog.text
    assert robot.parameters == PARAMETERS


def test_navigation_is_waited_for(robot: Robot) -> None:
    robot.open()
    run = robot.run(nav2_active(manager="manager"))
    assert (run.outcome, run.duration, robot.questions) == ("succeeded", 2.0, 3)
