"""Goals at ROS 2's own server and at ours: the same conversations must have the same answers."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.action.client import ActionClient
from actionlib_core.action.server import ActionServer, ServerGoalHandle
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.goal_states import ENDED, CancelCode, GoalCode
from actionlib_core.wire.ros2.names import goal_uuid
from tests.actionlib_core.wire.rclpy.programs.goal_conversations import CONVERSATIONS, NONE, A
from tests.ros2_client import Ros2Client
from tests.ros2_server import Ros2Server

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import VirtualClock
    from tests.actionlib_core.wire.rclpy.conftest import Rclpy

pytestmark = pytest.mark.rclpy


class World:
    """A server of ours, in virtual time, and a client on the wire; see `goal_conversations`."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock = clock
        network = MemoryNetwork(clock)
        self.node = Node("world", transport=network.session(), clock=clock)
        self.goals: dict[bytes, ServerGoalHandle] = {}
        self.server = ActionServer("fib", Fibonacci, self._take, lambda _: None, node=self.node)
        self.session = network.session()
        self.client = Ros2Client(self.session, clock, "fib", Fibonacci)
        assert self.client.ready.wait(5.0)

    def close(self) -> None:
        self.client.close()
        self.session.close()
        self.node.close()
        self.node.transport.close()
        assert self.client.problems == []

    def _take(self, handle: ServerGoalHandle) -> None:
        if handle.get_goal().order < 0:
            handle.set_rejected()
        else:  # as it does nothing yet, it counts as accepted after a moment
            self.goals[bytes.fromhex(handle.goal.goal_id.id)] = handle

    def follow(self, codes: list[int]) -> list[str]:
        """What a client of ours sees of a goal that another server leads through these states."""
        server = Ros2Server(self.session, self.clock, "led", Fibonacci)
        client = ActionClient("led", Fibonacci, node=self.node)
        assert client.wait_for_action_server_to_start(5.0)
        goal = client.send_goal(Fibonacci.Goal(order=3))
        uuid = goal_uuid(goal.get_goal_id())
        server.wait(lambda: uuid in server.asked)
        seen = []
        for code in codes:
            (server.end if code in ENDED else server.set_state)(uuid, code)
            self.clock.sleep(0.1)
            seen.append(Status(goal.get_goal_status()).name)
        client.stop()
        server.close()
        assert server.problems == []
        return seen

    def send(self, uuid: bytes, order: int) -> bool:
        return self.client.accepted(uuid, Fibonacci.Goal(order=order)) is not None

    def execute(self, uuid: bytes) -> None:
        self.goals[uuid].set_accepted()

    def finish(self, uuid: bytes, how: str) -> None:
        handle = self.goals[uuid]
        result = Fibonacci.Result(sequence=[handle.get_goal().order])
        getattr(handle, f"set_{how}")(result)

    def cancel(self, uuid: bytes = NONE, up_to: bytes | None = None) -> list[Any]:
        stamp_ns = 0
        if up_to is not None:
            (stamp_ns,) = (s.stamp_ns for s in self.client.statuses[-1] if s.uuid == up_to)
        code, goals = self.client.cancel(uuid, stamp_ns)
        return [code, sorted(uuid.hex() for uuid, _ in goals)]

    def result(self, uuid: bytes) -> Callable[[], list[Any]]:
        asked = self.client.result(uuid)

        def end() -> list[Any]:
            status, result = self.client.end_of(asked)
            return [status, list(result.sequence)]

        return end

    def state(self, uuid: bytes, code: int) -> None:
        deadline = self.clock.now() + 5.0
        while {s.uuid: s.code for s in (self.client.statuses or [[]])[-1]}.get(uuid) != code:
            assert self.clock.now() < deadline, (uuid, code, self.client.statuses[-1:])
            self.clock.sleep(0.01)


@pytest.fixture
def world(clock: VirtualClock) -> Iterator[World]:
    world = World(clock)
    yield world
    world.close()


@pytest.mark.parametrize("name", CONVERSATIONS)
def test_our_server_answers_as_theirs(rclpy: Rclpy, world: World, name: str) -> None:
    ours = CONVERSATIONS[name](world)
    assert ours == rclpy.ask("converse", name)[0]


@pytest.mark.parametrize(
    ("name", "codes", "seen"),
    [
        ("succeeded", [1, 2, 4], "PENDING ACTIVE SUCCEEDED"),
        ("aborted", [1, 2, 6], "PENDING ACTIVE ABORTED"),
        ("canceled", [1, 2, 3, 5], "PENDING ACTIVE PREEMPTING PREEMPTED"),
        ("succeeded although canceling", [1, 2, 3, 4], "PENDING ACTIVE PREEMPTING SUCCEEDED"),
        ("aborted although canceling", [1, 2, 3, 6], "PENDING ACTIVE PREEMPTING ABORTED"),
        ("cancelled before it runs", [1, 3, 5], "PENDING RECALLING RECALLED"),
    ],
)
def test_states_on_the_wire_and_at_our_client(
    rclpy: Rclpy, world: World, name: str, codes: list[int], seen: str
) -> None:
    """Theirs and ours show the same states; shown to our client, they are those of the table."""
    assert list(rclpy.ask("converse", name)[1].values()) == [codes]
    CONVERSATIONS[name](world)
    lists = [{state.uuid: state.code for state in states} for states in world.client.statuses]
    ours = [listed[A] for listed in lists if A in listed]
    assert [code for code, _ in itertools.groupby(ours)] == codes
    assert world.follow(codes) == seen.split()


def test_a_refused_cancel_is_answered_with_no_error_and_no_goals(rclpy: Rclpy) -> None:
    """What our clients are tested with: the code tells nothing, the list does."""
    nothing = [CancelCode.NONE, []]
    assert rclpy.ask("refuse_a_cancel") == [nothing, nothing, [GoalCode.SUCCEEDED, [3]]]
