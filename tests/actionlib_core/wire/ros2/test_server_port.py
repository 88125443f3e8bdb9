"""Our action servers as clients of ROS 2 see them, on every transport and in virtual time."""

from __future__ import annotations

import itertools
import threading
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.action.decorated import GoalContext, Reject, server
from actionlib_core.action.server import ActionServer, ServerGoalHandle
from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.exceptions import ServerConflictError, TransportError
from actionlib_core.goal.ports import StatusEntry
from actionlib_core.goal.states import Status
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.ros2.action_messages import (
    CancelRequest,
    CancelResponse,
    pack_id,
    pack_with_id,
    unpack_accepted,
)
from actionlib_core.wire.ros2.attachment import Attachment, pack_attachment
from actionlib_core.wire.ros2.goal_states import GoalCode
from actionlib_core.wire.ros2.graph import RosType
from actionlib_core.wire.ros2.names import NO_GOAL, Kind
from actionlib_core.wire.ros2.parameters import SERVICES
from actionlib_core.wire.ros2.server_port import DECISION_S, choose_cancelled
from tests.ros2_client import Ros2Client

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import VirtualClock

_numbers = itertools.count(1)


def new_id() -> bytes:
    return next(_numbers).to_bytes(16, "big")


class World:
    """A node for servers, and clients of ROS 2 beside it, in virtual time."""

    def __init__(self, clock: VirtualClock) -> None:
        self.clock, self.network = clock, MemoryNetwork(clock)
        self.node = Node("robot", transport=self.network.session(), clock=clock)
        self.goals: list[ServerGoalHandle] = []
        self.cancelled: list[ServerGoalHandle] = []
        self.closing: list[Callable[[], object]] = []

    def serve(self, **options: Any) -> ActionServer:
        """Offer "fib" by a server whose goals the test itself decides about."""
        return ActionServer(
            "fib", Fibonacci, self.goals.append, self.cancelled.append, node=self.node, **options
        )

    def client(self, node: str = "asker") -> Ros2Client:
        session = self.network.session()
        client = Ros2Client(session, self.clock, "fib", Fibonacci, node=node)
        self.closing += [session.close, client.close]
        assert client.ready.wait(5.0)
        return client

    def settle(self) -> None:
        self.clock.sleep(1.1)  # the server's list goes out once a second at least

    def send(self, client: Ros2Client, order: int = 3) -> bytes:
        """Send a goal that the server's code accepts."""
        uuid, before = new_id(), len(self.goals)
        pending = client.send(uuid, Fibonacci.Goal(order=order))
        while len(self.goals) == before:
            self.clock.sleep(0.001)
        self.goals[-1].set_accepted()
        payload = pending.answer().payload
        assert payload is not None
        assert unpack_accepted(payload) is not None
        return uuid


@pytest.fixture
def world(clock: VirtualClock) -> Iterator[World]:
    world = World(clock)
    yield world
    for close in reversed(world.closing):
        close()
    world.node.close()
    world.node.transport.close()
    assert [p for c in world.closing for p in getattr(c, "problems", [])] == []


def codes(client: Ros2Client) -> dict[bytes, int]:
    return {state.uuid: state.code for state in client.statuses[-1]} if client.statuses else {}


def test_a_goal_from_acceptance_to_result(world: World) -> None:
    world.serve()
    client = world.client()
    uuid = new_id()
    pending = client.send(uuid, Fibonacci.Goal(order=5))
    world.clock.sleep(0.01)
    (goal,) = world.goals
    assert goal.get_goal() == goal.goal.goal == Fibonacci.Goal(order=5)
    assert goal.goal.goal_id.id == uuid.hex()
    assert not pending.done.is_set()
    now_ns = world.clock.time_ns()
    goal.set_accepted()
    stamp_ns = unpack_accepted(pending.answer().payload)
    assert 0 <= now_ns - stamp_ns < 1e9
    results = [client.result(uuid) for _ in range(3)]
    world.settle()
    assert codes(client) == {uuid: 2}
    assert client.statuses[-1][0].stamp_ns == stamp_ns
    goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
    world.settle()
    assert client.feedback == [(uuid, Fibonacci.Feedback(sequence=[0, 1]))]
    assert not any(result.done.is_set() for result in results)
    goal.set_succeeded(Fibonacci.Result(sequence=[0, 1, 1]))
    for result in (*results, client.result(uuid)):
        assert client.end_of(result) == (4, Fibonacci.Result(sequence=[0, 1, 1]))
    world.settle()
    assert codes(client) == {uuid: 4}
    assert client.problems == []


@pytest.mark.parametrize(("own", "said"), [("", "no way"), ("blocked", "blocked")])
def test_the_reason_of_a_failure_is_in_the_result(world: World, own: str, said: str) -> None:
    ActionServer("drive", NavigateToPose, world.goals.append, node=world.node)
    session = world.network.session()
    client = Ros2Client(session, world.clock, "drive", NavigateToPose)
    world.closing += [session.close, client.close]
    assert client.ready.wait(5.0)
    uuid = new_id()
    client.send(uuid, NavigateToPose.Goal())
    early = client.result(uuid)
    world.clock.sleep(0.01)
    world.goals[0].set_accepted()
    world.goals[0].set_aborted(NavigateToPose.Result(error_code=7, error_msg=own), "no way")
    for asked in (early, client.result(uuid)):
        assert client.end_of(asked) == (6, NavigateToPose.Result(error_code=7, error_msg=said))


def test_statuses_are_sent_when_something_changes_and_not_again(world: World) -> None:
    world.serve()
    client = world.client()
    world.send(client)
    world.settle()
    before = len(client.statuses)
    world.clock.sleep(30.0)
    assert len(client.statuses) == before
    world.goals[0].set_succeeded()
    world.settle()
    assert len(client.statuses) == before + 1


def test_statuses_while_the_servers_lock_is_held(world: World) -> None:
    """One thread holds the server's lock and changes a goal, another sends the list meanwhile."""
    action_server = world.serve()
    client = world.client()
    uuid = world.send(client)
    port, list_goals = action_server.keeper.port, action_server.keeper.list_goals
    listing, ended = threading.Event(), threading.Event()

    def slow_list() -> list[StatusEntry]:
        listing.set()
        ended.wait(60.0)
        return list_goals()

    action_server.keeper.list_goals = slow_list
    other = threading.Thread(target=port.send_status, args=((),))
    with action_server.lock:
        other.start()
        assert listing.wait(60.0)
        world.goals[0].set_succeeded()
        port.send_status(())
        ended.set()
    other.join()
    world.settle()
    assert codes(client) == {uuid: 4}


def test_a_late_client_gets_the_last_list(world: World) -> None:
    world.serve()
    uuid = world.send(world.client())
    world.settle()
    late = world.client("late")
    world.settle()
    assert codes(late) == {uuid: 2}


def test_a_refused_goal_is_no_goal(world: World) -> None:
    world.serve()
    client = world.client()
    uuid = new_id()
    pending, result = client.send(uuid, Fibonacci.Goal(order=-1)), client.result(uuid)
    world.clock.sleep(0.01)
    world.goals[0].set_rejected(text="below 0")
    assert unpack_accepted(pending.answer().payload) is None
    assert client.end_of(result) == (0, Fibonacci.Result())
    assert client.end_of(client.result(uuid)) == (0, Fibonacci.Result())
    assert client.cancel(uuid) == CancelResponse(2, ())
    world.settle()
    assert codes(client) == {}


def test_who_decides_late_has_accepted_and_a_later_refusal_is_an_abort(world: World) -> None:
    world.serve()
    client = world.client()
    uuid, began = new_id(), world.clock.now()
    assert client.accepted(uuid, Fibonacci.Goal(order=1)) is not None
    assert DECISION_S <= world.clock.now() - began < DECISION_S + 0.1
    world.settle()
    assert codes(client) == {uuid: 1}
    world.goals[0].set_rejected(Fibonacci.Result(sequence=[7]))
    assert client.end_of(client.result(uuid)) == (6, Fibonacci.Result(sequence=[7]))
    world.settle()
    assert codes(client) == {uuid: 6}
    assert client.cancel(uuid) == CancelResponse(3, ())


def test_a_callback_that_blocks_holds_up_nobody_else(world: World) -> None:
    free = world.clock.event()
    ActionServer("fib", Fibonacci, lambda _: free.wait(), node=world.node)
    client = world.client()
    assert client.accepted(new_id(), Fibonacci.Goal()) is not None
    assert client.accepted(new_id(), Fibonacci.Goal()) is not None
    free.set()


def test_a_callback_that_raises_refuses(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("threading.excepthook", lambda _: None)
    ActionServer("fib", Fibonacci, lambda _: 1 / 0, node=world.node)
    client = world.client()
    assert client.accepted(new_id(), Fibonacci.Goal()) is None


def test_an_id_is_taken_once(world: World) -> None:
    world.serve(result_timeout=2.0)
    client = world.client()
    uuid = new_id()
    first, again = (client.send(uuid, Fibonacci.Goal(order=n)) for n in range(2))
    assert unpack_accepted(again.answer().payload) is None
    world.goals[0].set_accepted()
    assert unpack_accepted(first.answer().payload) is not None
    assert client.accepted(uuid, Fibonacci.Goal()) is None
    world.goals[0].set_succeeded()
    assert client.accepted(uuid, Fibonacci.Goal()) is None
    world.clock.sleep(10.0)  # the result is forgotten, the id is not
    assert client.accepted(uuid, Fibonacci.Goal()) is None
    assert client.end_of(client.result(uuid)) == (0, Fibonacci.Result())
    assert len(world.goals) == 1
    assert client.accepted(NO_GOAL, Fibonacci.Goal()) is None


@pytest.mark.parametrize(
    ("end", "code"), [("set_succeeded", 4), ("set_canceled", 5), ("set_aborted", 6)]
)
def test_a_result_is_kept_and_then_forgotten(world: World, end: str, code: int) -> None:
    world.serve(result_timeout=10.0)
    client = world.client()
    uuid = world.send(client)
    assert client.cancel(uuid).code == 0
    getattr(world.goals[0], end)(Fibonacci.Result(sequence=[1]))
    world.clock.sleep(8.0)
    assert client.end_of(client.result(uuid)) == (code, Fibonacci.Result(sequence=[1]))
    world.clock.sleep(4.0)
    assert client.end_of(client.result(uuid)) == (0, Fibonacci.Result())
    assert client.end_of(client.result(new_id())) == (0, Fibonacci.Result())


def test_cancel_of_one_goal(world: World) -> None:
    world.serve()
    client = world.client()
    uuid, other = world.send(client), world.send(client)
    goal, untouched = world.goals
    answer = client.cancel(uuid)
    assert answer == CancelResponse(0, ((uuid, goal.record.stamp_ns),))
    assert client.cancel(uuid) == CancelResponse(3, ())
    assert client.cancel(new_id()) == CancelResponse(2, ())
    world.settle()
    assert world.cancelled == [goal]
    assert codes(client) == {uuid: 3, other: 2}
    goal.set_canceled()
    assert client.cancel(uuid) == CancelResponse(3, ())
    assert untouched.record.status is Status.ACTIVE


def test_cancel_of_all_and_by_stamp(world: World) -> None:
    world.serve()
    client = world.client()
    assert client.cancel(NO_GOAL) == CancelResponse(0, ())
    ids = []
    for _ in range(4):
        ids.append(world.send(client))
        world.clock.sleep(1.0)
    stamps = [goal.record.stamp_ns for goal in world.goals]
    assert stamps == sorted(set(stamps))
    assert client.cancel(NO_GOAL, stamps[1]).goals == tuple(zip(ids[:2], stamps[:2], strict=True))
    assert client.cancel(ids[3], stamps[1]).goals == ((ids[3], stamps[3]),)
    assert client.cancel(NO_GOAL).goals == ((ids[2], stamps[2]),)
    assert client.cancel(NO_GOAL) == CancelResponse(0, ())
    late = world.send(client)
    assert world.goals[-1].record.status is Status.ACTIVE
    far = client.cancel(NO_GOAL, world.clock.time_ns() + 10**18)
    assert [uuid for uuid, _ in far.goals] == [late]
    world.send(client)
    assert world.goals[-1].record.status is Status.ACTIVE


def test_a_cancel_before_acceptance_recalls(world: World) -> None:
    world.serve()
    client = world.client()
    uuid = new_id()
    pending, result = client.send(uuid, Fibonacci.Goal()), client.result(uuid)
    world.clock.sleep(0.01)
    assert [found for found, _ in client.cancel(uuid).goals] == [uuid]
    world.goals[0].set_canceled()
    assert unpack_accepted(pending.answer().payload) is not None
    assert client.end_of(result)[0] == 5
    assert world.goals[0].record.status is Status.RECALLED


def test_a_cancel_of_an_unknown_goal_does_not_reach_one_that_comes_later(world: World) -> None:
    world.serve()
    client = world.client()
    uuid = new_id()
    assert client.cancel(uuid) == CancelResponse(2, ())
    assert client.accepted(uuid, Fibonacci.Goal()) is not None


def test_simple_server_one_goal_after_another(world: World) -> None:
    def execute(goal: Any) -> None:
        while not simple.is_preempt_requested():
            world.clock.sleep(0.1)
        simple.set_preempted(Fibonacci.Result(sequence=[goal.order]))

    simple = SimpleActionServer("fib", Fibonacci, execute, auto_start=True, node=world.node)
    client = world.client()
    first, second = new_id(), new_id()
    assert client.accepted(first, Fibonacci.Goal(order=1)) is not None
    result = client.result(first)
    assert client.accepted(second, Fibonacci.Goal(order=2)) is not None  # preempts the first
    assert client.end_of(result) == (5, Fibonacci.Result(sequence=[1]))
    assert client.cancel(second).code == 0
    assert client.end_of(client.result(second)) == (5, Fibonacci.Result(sequence=[2]))


def test_decorated_server(world: World) -> None:
    @server("fib", Fibonacci)
    def fib(goal: Any, context: GoalContext[Any]) -> Any:
        if goal.order < 0:
            raise Reject
        context.feedback(Fibonacci.Feedback(sequence=[0]))
        return Fibonacci.Result(sequence=[0, 1])

    with fib.start(node=world.node):
        client = world.client()
        uuid = new_id()
        assert client.accepted(new_id(), Fibonacci.Goal(order=-1)) is None
        assert client.accepted(uuid, Fibonacci.Goal(order=2)) is not None
        assert client.end_of(client.result(uuid)) == (4, Fibonacci.Result(sequence=[0, 1]))
        assert [feedback for _, feedback in client.feedback] == [Fibonacci.Feedback(sequence=[0])]


ODD = [
    ("no attachment", None, b""),
    ("short attachment", b"123", b""),
    ("negative number", b"\xff" * 8 + bytes(8) + b"\x10" + bytes(16), b""),
    ("nothing", b"ours", b""),
    ("cut short", b"ours", b"\0\1\0\0" + bytes(15)),
    ("no CDR", b"ours", bytes([0, 7, 0, 0]) + bytes(40)),
]


@pytest.mark.parametrize("part", ["send_goal", "cancel_goal", "get_result"])
@pytest.mark.parametrize(
    ("attachment", "payload"), [odd[1:] for odd in ODD], ids=[o[0] for o in ODD]
)
def test_malformed_requests_do_no_harm(
    world: World,
    part: str,
    attachment: bytes | None,
    payload: bytes,
    caplog: pytest.LogCaptureFixture,
) -> None:
    world.serve()
    client = world.client()
    name = getattr(client.names, part)
    for _ in range(3):
        answer = client.ask(name, payload or pack_id(new_id()), attachment).answer()
        if payload or attachment != b"ours":
            assert "expected" in answer.error
    assert len([r for r in caplog.records if r.name.endswith("server_port")]) <= 1
    uuid = world.send(client)
    world.goals[-1].set_succeeded()
    assert client.end_of(client.result(uuid))[0] == 4


def test_a_goal_cut_short_is_refused_with_an_error(world: World) -> None:
    world.serve()
    client = world.client()
    payload = pack_with_id(new_id(), Fibonacci.Goal(order=1).to_cdr())[:-1]
    assert client.ask(client.names.send_goal, payload).answer().error
    assert world.goals == []


def test_trailing_and_big_endian_bytes_are_read(world: World) -> None:
    world.serve()
    client = world.client()
    uuid = new_id()
    client.ask(client.names.send_goal, b"\0\0\0\0" + uuid + b"\0\0\0\x07" + b"more")
    world.clock.sleep(0.1)
    assert world.goals[0].get_goal().order == 7


def test_the_same_number_twice_does_no_harm(world: World) -> None:
    world.serve()
    client = world.client()
    attachment = pack_attachment(Attachment(5, 1, bytes(16)))
    asked = [
        client.ask(
            client.names.send_goal, pack_with_id(new_id(), Fibonacci.Goal().to_cdr()), attachment
        )
        for _ in range(2)
    ]
    assert all(unpack_accepted(pending.answer().payload) is not None for pending in asked)


def test_the_tokens_of_a_server(world: World) -> None:
    action_server = world.serve()
    client = world.client()
    tokens = [t for t in client.node.list() if t.session == world.node.transport.session_id]
    assert {t.name for t in tokens if t.name.startswith("robot/")} == {
        f"robot/{service}" for service in SERVICES
    }
    assert sorted((t.kind, t.name) for t in tokens if not t.name.startswith("robot/")) == sorted(
        [
            (Kind.NODE, ""),
            (Kind.SERVICE, "fib/_action/send_goal"),
            (Kind.SERVICE, "fib/_action/cancel_goal"),
            (Kind.SERVICE, "fib/_action/get_result"),
            (Kind.PUBLISHER, "fib/_action/feedback"),
            (Kind.PUBLISHER, "fib/_action/status"),
        ]
    )
    assert {t.node for t in tokens} == {"robot"}
    assert [t.qos.latched for t in tokens if t.name == "fib/_action/status"] == [True]
    action_server.stop()
    world.clock.sleep(0.1)
    assert len(client.servers) == 0


def test_a_server_that_stops_answers_everybody(world: World) -> None:
    action_server = world.serve()
    client = world.client()
    running = world.send(client)
    result = client.result(running)
    undecided = client.send(new_id(), Fibonacci.Goal())
    world.clock.sleep(0.01)
    action_server.stop()
    assert client.end_of(result)[0] == 6
    assert unpack_accepted(undecided.answer().payload) is None
    assert client.send(new_id(), Fibonacci.Goal()).answer().payload is None
    with pytest.raises(TransportError):
        world.goals[0].publish_feedback(Fibonacci.Feedback())


@pytest.mark.parametrize(("ended", "code"), [(True, GoalCode.SUCCEEDED), (False, 0)])
def test_a_request_for_a_result_is_answered_while_the_server_closes(
    world: World, monkeypatch: pytest.MonkeyPatch, ended: bool, code: int
) -> None:
    action_server, client = world.serve(), world.client()
    uuid, late = world.send(client), []
    if ended:
        world.goals[0].set_succeeded()
    port = action_server.keeper.port

    def close() -> None:  # the tokens are being withdrawn
        late.append(client.result(uuid))
        world.clock.sleep(0.05)

    first = next(iter(port._ends.values()))
    withdraw = first.close
    monkeypatch.setattr(first, "close", lambda: (withdraw(), close()))
    port.close()
    assert client.end_of(late[0])[0] == code


def test_a_client_that_waits_for_no_token_is_answered_in_full(world: World) -> None:
    """Its goal comes as soon as a server can be asked: one that was there before has the key."""
    gone = world.serve()
    client = world.client()
    gone.stop()
    uuids = iter([new_id() for _ in range(200)])
    asked, starting = [], world.clock.event()

    def ask() -> None:
        while not starting.wait(0.0):
            uuid = next(uuids)
            asked.append((uuid, client.send(uuid, Fibonacci.Goal(order=1))))
            world.clock.sleep(0.0005)

    asker = world.clock.spawn(ask, name="asker")

    def succeed(goal: ServerGoalHandle) -> None:
        goal.set_accepted()
        goal.publish_feedback(Fibonacci.Feedback(sequence=[1]))
        goal.set_succeeded()

    ActionServer("fib", Fibonacci, succeed, node=world.node)
    starting.set()
    asker.join(60.0)
    for uuid, pending in asked:
        if pending.answer().payload is not None:
            assert client.end_of(client.result(uuid))[0] == 4


def test_a_second_server_of_the_name_does_not_start(world: World, caplog: Any) -> None:
    world.serve()
    other = Node("other", transport=world.network.session(), clock=world.clock)
    with pytest.raises(ServerConflictError) as caught:
        ActionServer("fib", Fibonacci, node=other)
    assert caught.value.mine[0] == "other"
    assert caught.value.other == ("robot", world.node.transport.session_id)
    other.close()
    other.transport.close()


def test_a_client_that_dies_cancels_its_goals_where_that_is_asked_for(world: World) -> None:
    world.serve(on_client_lost="cancel")
    client, other = world.client(), world.client("other")
    world.send(client)
    world.send(other)
    client.transport.close()
    world.settle()
    assert world.cancelled == [world.goals[0]]


def test_a_client_with_another_hash_is_told_of(world: World, caplog: Any) -> None:
    world.serve()
    client = world.client()
    end = client.node.end(
        Kind.CLIENT, "fib/_action/send_goal", RosType("a/action/B_SendGoal", "RIHS01_1")
    )
    end.show()
    world.clock.sleep(0.1)
    (record,) = [r for r in caplog.records if "types differ" in r.message]
    assert "RIHS01_1" in record.message
    assert client.parts.send_goal.hash in record.message


def test_a_server_of_a_ros_1_type_where_the_configuration_says_ros_2(clock: VirtualClock) -> None:
    network = MemoryNetwork(clock)
    config = Config(ros2=(Ros2(domain=3, distro="kilted", names=("move_base",)),))
    node = Node("robot", transport=network.session(), clock=clock, config=config)
    heard: list[Any] = []

    def drive(goal: Any) -> None:
        heard.append(goal)
        there = MoveBaseFeedback()
        there.base_position.pose.position.x = 2.0
        simple.publish_feedback(there)
        simple.set_succeeded()

    simple = SimpleActionServer("move_base", MoveBaseAction, drive, auto_start=True, node=node)
    session = network.session()
    spec = ros2.get_action("nav2_msgs/NavigateToPose", "kilted")
    client = Ros2Client(session, clock, "navigate_to_pose", spec, domain=3)
    assert client.ready.wait(5.0)
    goal, uuid = spec.Goal(), new_id()
    goal.pose.header.frame_id, goal.pose.pose.position.x = "map", 1.5
    assert client.accepted(uuid, goal) is not None
    assert client.end_of(client.result(uuid)) == (4, spec.Result())
    clock.sleep(0.1)
    assert heard[0].target_pose.header.frame_id == "map"
    assert heard[0].target_pose.pose.position.x == 1.5
    assert client.feedback[0][1].current_pose.pose.position.x == 2.0
    assert client.problems == []
    client.close()
    for closing in (session, node, node.transport):
        closing.close()


def test_which_goals_a_cancel_is_about() -> None:
    goals = [
        StatusEntry(f"{number:032x}", number * 100, status, "")
        for number, status in enumerate([Status.ACTIVE, Status.SUCCEEDED, Status.PENDING] * 2, 1)
    ]
    running = [goal for goal in goals if goal.status is not Status.SUCCEEDED]
    assert choose_cancelled(goals, CancelRequest(NO_GOAL, 0)) == running
    assert choose_cancelled(goals, CancelRequest(NO_GOAL, 300)) == [goals[0], goals[2]]
    assert choose_cancelled(goals, CancelRequest(bytes.fromhex(goals[5].id), 100)) == [
        goals[0],
        goals[5],
    ]
    assert choose_cancelled(goals, CancelRequest(NO_GOAL, 99)) == []


@pytest.mark.parametrize("accepted", [True, False])
def test_lists_show_whether_a_cancelled_goal_has_run(world: World, accepted: bool) -> None:
    """Changes go together in a list; what tells whether a cancelled goal has run is not skipped."""
    world.serve()
    client = world.client()
    uuid = new_id()
    client.send(uuid, Fibonacci.Goal())
    while not world.goals:
        world.clock.sleep(0.001)
    if accepted:
        world.goals[-1].set_accepted()
    assert client.cancel(uuid).code == 0
    world.goals[-1].set_canceled()
    assert client.end_of(client.result(uuid))[0] == 5
    world.settle()
    codes = [state.code for states in client.statuses for state in states if state.uuid == uuid]
    assert codes == sorted(codes)
    assert (GoalCode.EXECUTING in codes) is accepted
    assert (GoalCode.ACCEPTED in codes) is not accepted


def test_the_list_that_was_skipped_goes_before_a_cancel(world: World) -> None:
    keeper, client = world.serve().keeper, world.client()
    ids = [new_id() for _ in range(3)]

    def show(*statuses: Status) -> list[list[int]]:
        client.statuses.clear()
        listed = zip(ids, statuses, strict=True)
        keeper.list_goals = lambda: entries
        entries = [StatusEntry(uuid.hex(), 1, status, "") for uuid, status in listed]
        keeper.port.send_status(())
        world.clock.sleep(0.01)
        assert all([state.uuid for state in states] == ids for states in client.statuses)
        return [[state.code for state in states] for states in client.statuses]

    stopped = Status.PREEMPTING, Status.RECALLED, Status.ACTIVE
    assert show(*stopped) == [[2, 1, 2], [3, 5, 2]]
    assert show(*stopped) == []
    assert show(Status.PREEMPTED, Status.RECALLED, Status.SUCCEEDED) == [[5, 5, 4]]
    assert show(Status.PENDING, Status.ACTIVE, Status.ACTIVE) == [[1, 2, 2]]
    assert show(Status.PREEMPTED, Status.PREEMPTED, Status.ABORTED) == [[2, 5, 6], [5, 5, 6]]
