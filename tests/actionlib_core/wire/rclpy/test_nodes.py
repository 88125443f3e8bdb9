"""Parameters and life cycles: the scripted node of the test kit answers as a node of rclpy does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.exceptions import RemoteNodeError
from actionlib_core.pubsub.remote_node import RemoteNode
from smachpy import CBState, StateMachine
from smachpy.testing import mission_kit

if TYPE_CHECKING:
    from tests.actionlib_core.wire.rclpy.conftest import Rclpy

pytestmark = pytest.mark.rclpy

PARAMETERS = {"speed": 0.5, "samples": 3, "open": False, "frame": "odom"}
ALL = ("get_parameters", list(PARAMETERS))
ASKED: list[tuple[str, Any]] = [
    ALL,
    ("set_parameters", {"speed": 0.25, "samples": 7, "open": True, "frame": "map"}),
    ALL,
    ("set_parameters", {"speed": "fast", "samples": 2.5, "open": 1, "frame": False}),
    ("set_parameters", {"speed": 1.5, "unknown": 1, "samples": 9}),
    ALL,
    ("get_parameters", ["speed", "unknown"]),
    *(
        ("change_state", label)
        for label in (
            *("activate", "configure", "configure", "activate", "cleanup", "deactivate"),
            *("cleanup", "configure", "no such", "shutdown", "configure"),
        )
    ),
]


def answers_of_ours() -> list[Any]:
    """What a scripted node answers."""
    found: list[Any] = []

    def ask(_: Any) -> str:
        remote = RemoteNode("robot")
        for name, argument in ASKED:
            try:
                if name == "get_parameters":
                    found.append([*remote.get_parameters(*argument).values()])
                elif name == "set_parameters":
                    found.append([])
                    remote.set_parameters(argument)
                else:
                    found.append([True, ""])
                    remote.change_state(argument)
            except RemoteNodeError as error:
                if name == "get_parameters":
                    found.append([])
                elif name == "set_parameters":
                    found[-1] = [one for one in argument if one in error.problems]
                else:
                    found[-1][0] = False
            if name == "change_state":
                found[-1][1] = remote.state()
        remote.close()
        return "done"

    sm = StateMachine(["done"])
    sm.add("ASK", CBState(ask, outcomes=["done"]))
    with mission_kit() as kit:
        kit.ros2_node("robot", PARAMETERS, state="unconfigured")
        kit(sm)
    return found


def test_a_node_of_rclpy_and_a_scripted_one_answer_the_same(rclpy: Rclpy) -> None:
    theirs, ours = rclpy.ask("ask_a_node", PARAMETERS, ASKED), answers_of_ours()
    assert [*zip(ASKED, ours, strict=True)] == [*zip(ASKED, theirs, strict=True)]
