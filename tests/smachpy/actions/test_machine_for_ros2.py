"""A state machine offered to ROS 2 as an action, asked by a client that only knows that wire."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node, use_node
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import ActionServerWrapper, State, StateMachine
from tests.ros2_client import Ros2Client

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.clock import VirtualClock


class Count(State):
    """Adds a number a second to the feedback; goes on until it is done or preempted."""

    def __init__(self) -> None:
        super().__init__(["done", "preempted"], ["order", "numbers"], ["numbers"])

    def execute(self, userdata: Any) -> str:
        for number in range(userdata.order):
            userdata.numbers = [*userdata.numbers, number]
            if self.sleep(1.0):
                return "preempted"
        return "done"


@pytest.fixture
def client(clock: VirtualClock) -> Iterator[Ros2Client]:
    network = MemoryNetwork(clock)
    node = Node("robot", transport=network.session(), clock=clock)
    with use_node(node):
        sm = StateMachine(["done", "preempted"], ["order"], ["numbers"])
        sm.userdata.numbers = []
        with sm:
            StateMachine.add("COUNT", Count())
        wrapper = ActionServerWrapper(
            "fib",
            Fibonacci,
            sm,
            ["done"],
            [],
            ["preempted"],
            goal_slots_map={"order": "order"},
            feedback_slots_map={"sequence": "numbers"},
            result_slots_map={"sequence": "numbers"},
        )
        wrapper.run_server()
        session = network.session()
        client = Ros2Client(session, clock, "fib", Fibonacci)
        assert client.ready.wait(5.0)
        yield client
        client.close()
        session.close()
        node.close()
        node.transport.close()


def test_a_machine_runs_for_a_goal(client: Ros2Client) -> None:
    uuid = bytes([1] * 16)
    assert client.accepted(uuid, Fibonacci.Goal(order=3)) is not None
    assert client.end_of(client.result(uuid)) == (4, Fibonacci.Result(sequence=[0, 1, 2]))
    told = [list(feedback.sequence) for _, feedback in client.feedback]
    assert [0, 1] in told
    assert told == sorted(told)
    assert client.problems == []


def test_a_cancel_preempts_it(clock: VirtualClock, client: Ros2Client) -> None:
    uuid = bytes([2] * 16)
    assert client.accepted(uuid, Fibonacci.Goal(order=100)) is not None
    clock.sleep(2.5)
    began = clock.now()
    assert client.cancel(uuid).code == 0
    assert client.end_of(client.result(uuid)) == (5, Fibonacci.Result(sequence=[0, 1, 2]))
    assert clock.now() - began < 0.5
