"""Our action clients on real Zenoh behind a router, answered with the bytes of a real server."""

from __future__ import annotations

import json
import logging
from collections import defaultdict
from typing import TYPE_CHECKING, Any

import pytest

from actionlib_core.action.client import ActionClient, ClientGoalHandle
from actionlib_core.goal.states import CommState, Status
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from tests.places import DATA
from tests.ros2_robot import DOMAIN
from tests.ros2_server import Ros2Server

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.transport import Query
    from tests.ros2_robot import Ros2Robot

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
GOLDEN = [json.loads(line) for line in (DATA / "ros2_golden.jsonl").read_text().splitlines()]
CALLS = [line for line in GOLDEN if line["kind"] == "call" and "/_action/" in line["key"]]
UNKNOWN = next(call for call in CALLS if call["what"] == "fib get_result unknown goal")
ACCEPTED = next(call for call in CALLS if call["what"] == "fib send_goal accepted")

SUCCEEDS = "1978dd1ad8f246ee85e742addca96d46"
ABORTS = "d57ba61725a445d9a4eaa263f98e7e25"
REJECTED = "a4e8bb8c68794ac5a0bd3da87dbb62ce"
CANCELED = "888c2c9782764bcf92a1b5c33ca86d7e"
REFUSES_CANCEL = "a2d49163bc0144ab908cb38b7d27839b"
TWO_AT_ONCE = "af53c53e4afb46b69307f22084abdae9", "44fdb45ea149460a9678fc3665b18948"
NOT_KNOWN = "77553cf69b244397ab8b2584e2c71dc8"
DRIVES = "c8044acd2a6b4408906394347c166145"
WATCHED = "69f3a9af477245c6afacad11bc9eae2e", "ca54dd95077c49c4952a8e0a790c84be"


class Replay(Ros2Server):
    """Answers each request with what a real server answered to the same bytes, in that order.

    Questions for results are kept until `end`; an answer put into `instead` goes out first, None
    there is a request that is dropped.
    """

    def __init__(self, robot: Ros2Robot, name: str = "fib", action: Any = Fibonacci) -> None:
        self.answers: dict[bytes, list[bytes]] = defaultdict(list)
        for call in CALLS:
            if call["key"].startswith(f"{DOMAIN}/{name}/"):
                key = call["key"].encode() + bytes.fromhex(call["request"])
                self.answers[key].append(bytes.fromhex(call["reply"]))
        self.instead: dict[bytes, list[bytes | None]] = defaultdict(list)
        super().__init__(robot.session(), robot.clock, name, action, domain=DOMAIN, distro="kilted")
        robot.left.callback(self.close)
        self.on_goal = self.on_cancel = self.replay

    def replay(self, query: Query, _: bytes) -> None:
        asked = query.key.encode() + query.payload
        if self.instead[asked]:
            answer = self.instead[asked].pop(0)
        elif self.answers[asked]:
            answer = self.answers[asked].pop(0)
        else:
            self.problems.append(f"nobody asked a real server {query.payload.hex()}")
            answer = None
        if answer is None:
            query.finish()
        else:
            self.reply(query, answer)

    def park(self, query: Query, uuid: bytes) -> None:
        self.asked.setdefault(uuid, []).append(query)

    def replay_result(self, goal_id: str) -> None:
        """Answer the question for a result, as soon as it has come."""
        uuid = bytes.fromhex(goal_id)
        self.wait(lambda: uuid in self.asked)
        for query in self.asked.pop(uuid):
            self.replay(query, uuid)

    def replay_message(self, line: dict[str, Any]) -> None:
        end = 3 if "/feedback/" in line["key"] else 4
        assert line["key"] == self.ends[end].key
        publisher = self.feedback if end == 3 else self.status
        publisher.put(bytes.fromhex(line["payload"]), self.ends[end].attachment())


class Client:
    """Sends the goals that were captured, under their ids."""

    def __init__(self, robot: Ros2Robot, name: str = "fib", action: Any = Fibonacci) -> None:
        self.action = action
        self.client = ActionClient(name, action, node=robot.node("mission"))
        self.states: list[str] = []
        self.feedback: list[list[int]] = []
        assert self.client.wait_for_server(LONG_S)

    def send(self, goal_id: str) -> ClientGoalHandle:
        sent = (
            {"goal_id": line["values"]["goal_id"], "payload": line["payload"]}
            for line in GOLDEN
            if line["kind"] == "request" and "/send_goal/" in line["key"]
        )
        called = (
            {"goal_id": call["request_values"]["goal_id"], "payload": call["request"]}
            for call in CALLS
            if "/send_goal/" in call["key"]
        )
        line = next(line for line in (*sent, *called) if line["goal_id"] == goal_id)
        raw = bytes.fromhex(line["payload"])
        self.client._ids.generate = lambda: (goal_id, 0)  # type: ignore[method-assign]
        return self.client.send_goal(
            self.action.Goal.from_cdr(raw[:4] + raw[20:]),
            lambda goal: self.states.append(goal.get_comm_state().name),
            lambda _, feedback: self.feedback.append(list(feedback.sequence)),
        )


def result_key(goal_id: str) -> bytes:
    call = next(call for call in CALLS if "/get_result/" in call["key"])
    return call["key"].encode() + b"\0\1\0\0" + bytes.fromhex(goal_id)


def messages(goal_id: str) -> Iterator[dict[str, Any]]:
    """Yield what was captured of a goal that a real client had sent, in order."""
    mine = False
    for line in GOLDEN:
        if line["kind"] not in {"message", "request"} or line["group"] != "fibonacci":
            continue
        if line["kind"] == "request":
            of = line["values"].get("goal_info", line["values"])["goal_id"]
            mine = of == goal_id
        if mine:
            yield line


def test_succeed_and_abort(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    for goal_id, status, numbers in (
        (SUCCEEDS, Status.SUCCEEDED, [0, 1, 1, 2, 3]),
        (ABORTS, Status.ABORTED, [0, 1, 1, 2, 3, 5, 8, 13, 21]),
    ):
        handle = client.send(goal_id)
        server.replay_result(goal_id)
        assert handle.wait(LONG_S)
        assert handle.get_goal_status() == status
        assert list(handle.get_result().sequence) == numbers
    assert server.problems == []


def test_drive(robot: Ros2Robot) -> None:
    server = Replay(robot, "navigate_to_pose", NavigateToPose)
    client = Client(robot, "navigate_to_pose", NavigateToPose)
    handle = client.send(DRIVES)
    server.replay_result(DRIVES)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert handle.get_result() == NavigateToPose.Result(error_code=9002, error_msg="no tf")
    assert server.problems == []


def test_statuses_and_feedback_of_a_goal_that_succeeds(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    goal_id, _ = WATCHED
    lines = list(messages(goal_id))
    sent = lines[0]["key"].encode() + bytes.fromhex(lines[0]["payload"])
    server.instead[sent] = [bytes.fromhex(ACCEPTED["reply"])]
    handle = client.send(goal_id)
    server.wait(lambda: bytes.fromhex(goal_id) in server.asked)
    for line in lines:
        if line["kind"] == "message":
            server.replay_message(line)
    reply = next(c["reply"] for c in CALLS if c["what"] == "fib get_result succeeded")
    server.instead[result_key(goal_id)] = [bytes.fromhex(reply)]
    server.replay_result(goal_id)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert [s for s in client.states if s != "PENDING"] == ["ACTIVE", "WAITING_FOR_RESULT", "DONE"]
    assert client.feedback == [[0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2, 3]]
    assert server.problems == []


def test_statuses_tell_of_a_cancel_whose_answer_is_lost(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    _, goal_id = WATCHED
    lines = list(messages(goal_id))
    sent, canceled = (
        line["key"].encode() + bytes.fromhex(line["payload"])
        for line in lines
        if line["kind"] == "request" and "/get_result/" not in line["key"]
    )
    server.instead[sent] = [bytes.fromhex(ACCEPTED["reply"])]
    server.instead[canceled] = [None]
    handle = client.send(goal_id)
    statuses = [line for line in lines if "/status/" in line["key"]]
    server.wait(lambda: bytes.fromhex(goal_id) in server.asked)
    for line in statuses[:2]:
        server.replay_message(line)
    handle.cancel()
    server.wait(lambda: server.cancels)
    for line in statuses[2:]:
        server.replay_message(line)
    reply = next(c["reply"] for c in CALLS if c["what"] == "fib get_result canceled")
    server.instead[result_key(goal_id)] = [bytes.fromhex(reply)]
    server.replay_result(goal_id)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.PREEMPTED
    assert server.problems == []


def test_reject(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    handle = client.send(REJECTED)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.REJECTED
    assert server.problems == []


def test_goal_that_is_sent_again_and_refused_for_its_id_is_followed(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    sent = next(call for call in CALLS if call["what"] == "fib send_goal same uuid again")
    key = sent["key"].encode() + bytes.fromhex(sent["request"])
    server.instead[key] = [None, bytes.fromhex(sent["reply"])]
    server.instead[result_key(SUCCEEDS)] = [bytes.fromhex(UNKNOWN["reply"])]
    handle = client.send(SUCCEEDS)
    server.replay_result(SUCCEEDS)
    server.wait(lambda: len(server.sent) == 2)
    server.replay_result(SUCCEEDS)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert list(handle.get_result().sequence) == [0, 1, 1, 2, 3]
    assert server.problems == []


def test_cancel(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    handle = client.send(CANCELED)
    server.wait(lambda: bytes.fromhex(CANCELED) in server.asked)
    handle.cancel()
    server.wait(lambda: server.cancels)
    server.replay_result(CANCELED)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.PREEMPTED
    assert list(handle.get_result().sequence) == [0, 1, 1, 2, 3, 5, 8]
    assert server.problems == []


def test_cancel_that_is_refused(robot: Ros2Robot, caplog: pytest.LogCaptureFixture) -> None:
    server, client = Replay(robot), Client(robot)
    handle = client.send(REFUSES_CANCEL)
    server.wait(lambda: bytes.fromhex(REFUSES_CANCEL) in server.asked)
    with caplog.at_level(logging.WARNING):
        handle.cancel()
        server.wait(lambda: server.cancels)
        other = client.send(REJECTED)  # behind the answer
        assert other.wait(LONG_S)
    assert not handle.wait(0.05)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert REFUSES_CANCEL in caplog.text
    assert server.problems == []


def test_cancel_of_a_goal_that_has_ended(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    handle = client.send(SUCCEEDS)
    server.wait(lambda: bytes.fromhex(SUCCEEDS) in server.asked)
    handle.cancel()
    server.wait(lambda: server.cancels)
    server.replay_result(SUCCEEDS)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.SUCCEEDED
    assert server.problems == []


def test_cancel_of_all(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    handles = [client.send(goal_id) for goal_id in TWO_AT_ONCE]
    server.wait(lambda: len(server.asked) == 2)
    client.client.cancel_all_goals()
    server.wait(lambda: server.cancels)
    statuses = {Status.PREEMPTING, Status.RECALLING}
    reply = next(c["reply"] for c in CALLS if c["what"] == "fib get_result canceled")
    for goal_id, handle in zip(TWO_AT_ONCE, handles, strict=True):
        server.instead[result_key(goal_id)] = [bytes.fromhex(reply)]
        server.replay_result(goal_id)
        assert handle.wait(LONG_S)
        assert handle.get_goal_status() not in statuses
    # On a busy computer a goal that still runs is cancelled again, by its id.
    (first, *again) = server.cancels
    assert first == (bytes(16), 0)
    assert {goal_id for goal_id, _ in again} <= {bytes.fromhex(one) for one in TWO_AT_ONCE}
    # The replayed server has no answer to those; it has one to all else.
    assert all(any(one in told for one in TWO_AT_ONCE) for told in server.problems)


def test_goal_that_nobody_knows(robot: Ros2Robot) -> None:
    server, client = Replay(robot), Client(robot)
    handle = client.client.attach(NOT_KNOWN)
    server.replay_result(NOT_KNOWN)
    assert handle.wait(LONG_S)
    assert handle.get_goal_status() == Status.LOST
    assert server.problems == []


def test_late_client_is_told_the_latched_status(robot: Ros2Robot) -> None:
    server = Replay(robot)
    server.replay_message(next(line for line in GOLDEN if line["kind"] == "latch_reply"))
    client = Client(robot)
    active = robot.clock.event()
    handle = client.client.attach(
        REFUSES_CANCEL,
        lambda goal: active.set() if goal.get_comm_state() is CommState.ACTIVE else None,
    )
    assert active.wait(LONG_S)
    assert handle.get_goal_status() == Status.ACTIVE
    assert server.problems == []
