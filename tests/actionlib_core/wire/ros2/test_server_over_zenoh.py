"""Our action servers on real Zenoh behind a router: captured conversations, and what breaks."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from typing import TYPE_CHECKING

import pytest

from actionlib_core.action.server import ActionServer, ServerGoalHandle
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node
from actionlib_core.wire.ros2.action_messages import unpack_accepted, unpack_cancel_response
from actionlib_core.wire.ros2.attachment import unpack_attachment
from tests.places import DATA
from tests.ros2_client import Ros2Client
from tests.ros2_robot import DOMAIN

if TYPE_CHECKING:
    from tests.ros2_robot import Ros2Robot

pytestmark = pytest.mark.zenoh

LONG_S = 60.0
CALLS = [
    line
    for line in map(
        json.loads,
        (DATA / "ros2_golden.jsonl").read_text().splitlines(),
    )
    if line["kind"] == "call" and line["key"].startswith("42/fib/_action/")
]
ENDS = {  # what a real server ended the goals of these conversations with
    3: ("set_succeeded", [0, 1, 1, 2, 3]),
    7: ("set_aborted", [0, 1, 1, 2, 3, 5, 8, 13, 21]),
    200: ("set_canceled", [0, 1, 1, 2, 3, 5, 8]),
    20: ("set_canceled", [0, 1]),
    55: ("set_canceled", []),
}
SERVER = """
import sys
import threading
from actionlib_core.action.server import ActionServer
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from actionlib_core.node import Node

config = Config(discovery="off", ros2=(Ros2(router=sys.argv[1], domain=42, mode=sys.argv[2]),))
with Node("robot", config=config) as node:
    server = ActionServer("fib", Fibonacci, lambda goal: goal.set_accepted(), node=node)
    print("ready", flush=True)
    server.wait()
"""


def client_of(robot: Ros2Robot) -> Ros2Client:
    client = Ros2Client(robot.session(), robot.clock, "fib", Fibonacci, domain=DOMAIN)
    robot.left.callback(client.close)
    assert client.ready.wait(LONG_S)
    return client


def server_process(robot: Ros2Robot, mode: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-c", SERVER, robot.endpoint, mode], stdout=subprocess.PIPE, text=True
    )
    robot.left.callback(process.wait)
    robot.left.callback(process.kill)
    assert process.stdout is not None
    robot.left.enter_context(process.stdout)
    assert process.stdout.readline() == "ready\n"
    return process


def answer(goal: ServerGoalHandle) -> None:
    """Do with a goal what the captured server did."""
    order = goal.get_goal().order
    if order < 0:
        goal.set_rejected()
        return
    goal.set_accepted()
    if order in {3, 7}:
        finish(goal)


def finish(goal: ServerGoalHandle) -> None:
    end, sequence = ENDS[goal.get_goal().order]
    getattr(goal, end)(Fibonacci.Result(sequence=sequence))


def test_captured_conversations_word_by_word(robot: Ros2Robot) -> None:
    """The bytes that a real server answered are sent again; values and attachments agree."""
    server = ActionServer("fib", Fibonacci, answer, finish, node=robot.node())
    client = client_of(robot)
    heard: list[str] = []
    for line in CALLS:
        part = line["key"].split("/_action/")[1].split("/")[0]
        assert client.ends[getattr(client.names, part)].key == line["key"]
        sent = bytes.fromhex(line["request_attachment"])
        payload = (
            client.ask(f"fib/_action/{part}", bytes.fromhex(line["request"]), sent)
            .answer(LONG_S)
            .payload
        )
        assert payload is not None, line["what"]
        values, heard = line["reply_values"], [*heard, line["what"]]
        if part == "send_goal":
            assert (unpack_accepted(payload) is not None) == values["accepted"], line["what"]
        elif part == "get_result":
            response = client.parts.get_result.response.from_cdr(payload)
            found = response.status, list(response.result.sequence)
            assert found == (values["status"], values["result"]["sequence"]), line["what"]
        elif "refused" in line["what"] or "none cancelable" in line["what"]:
            # Servers here cannot refuse a cancel; the list names what is canceling, and truly.
            assert unpack_cancel_response(payload).code == 0
        else:
            found = unpack_cancel_response(payload)
            assert found.code == values["return_code"], line["what"]
            asked = [uuid.hex() for uuid, _ in found.goals]
            assert asked == [goal["goal_id"] for goal in values["goals_canceling"]], line["what"]
    assert len(heard) == len(CALLS) == 20
    assert client.problems == []
    server.stop()


def test_the_attachment_of_a_reply_is_that_of_its_request(robot: Ros2Robot) -> None:
    ActionServer("fib", Fibonacci, node=robot.node())
    client = client_of(robot)
    line = CALLS[0]
    pending = client.ask(
        client.names.get_result,
        bytes.fromhex(line["request"])[:20],
        bytes.fromhex(line["request_attachment"]),
    )
    pending.answer(LONG_S)
    (reply,) = pending.replies
    back, asked = unpack_attachment(reply.attachment), line["request_attachment_values"]
    assert (back.sequence, back.gid.hex()) == (asked["sequence"], asked["gid"])
    assert back.time_ns != asked["timestamp_ns"]


def test_a_thousand_goals_at_once(robot: Ros2Robot) -> None:
    """Nothing is lost here: requests do not wait in a queue of ten."""

    def succeed(goal: ServerGoalHandle) -> None:
        goal.set_accepted()
        goal.set_succeeded(Fibonacci.Result(sequence=[goal.get_goal().order]))

    ActionServer("fib", Fibonacci, succeed, node=robot.node())
    client = client_of(robot)
    ids = {number: number.to_bytes(16, "big") for number in range(1, 1001)}
    sent = [client.send(uuid, Fibonacci.Goal(order=number)) for number, uuid in ids.items()]
    assert all(unpack_accepted(pending.answer(LONG_S).payload) is not None for pending in sent)
    results = {number: client.result(uuid) for number, uuid in ids.items()}
    for number, pending in results.items():
        pending.answer(LONG_S)
        assert client.end_of(pending) == (4, Fibonacci.Result(sequence=[number]))


@pytest.mark.slow
def test_a_router_that_is_started_again(robot: Ros2Robot) -> None:
    ActionServer("fib", Fibonacci, lambda goal: goal.set_accepted(), node=robot.node())
    client = client_of(robot)
    assert client.accepted(bytes([1] * 16), Fibonacci.Goal()) is not None
    robot.router.close()
    robot.route()
    again = client_of(robot)
    assert again.accepted(bytes([2] * 16), Fibonacci.Goal()) is not None
    assert again.accepted(bytes([1] * 16), Fibonacci.Goal()) is None


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_a_killed_server_is_seen_and_its_questions_end(robot: Ros2Robot, mode: str) -> None:
    process = server_process(robot, mode)
    client = client_of(robot)
    uuid = bytes([1] * 16)
    assert client.accepted(uuid, Fibonacci.Goal()) is not None
    result = client.result(uuid)
    process.send_signal(signal.SIGKILL)
    assert client.gone.wait(LONG_S)
    assert result.answer(LONG_S).payload is None
    assert len(client.servers) == 0


def test_a_suspended_server_goes_on(robot: Ros2Robot) -> None:
    process = server_process(robot, "client")
    client = client_of(robot)
    process.send_signal(signal.SIGSTOP)
    os.waitpid(process.pid, os.WUNTRACED)  # until it has stopped
    pending = client.send(bytes([1] * 16), Fibonacci.Goal())
    again = client.send(bytes([1] * 16), Fibonacci.Goal())
    assert not pending.done.wait(0.3)
    process.send_signal(signal.SIGCONT)
    assert unpack_accepted(pending.answer(LONG_S).payload) is not None
    assert unpack_accepted(again.answer(LONG_S).payload) is None
    assert client.cancel(bytes([1] * 16)).code == 0


def test_a_server_ends_with_its_node(robot: Ros2Robot) -> None:
    node = Node("robot", clock=robot.clock, config=robot.config)
    called = threading.Event()

    def accept(goal: ServerGoalHandle) -> None:
        goal.set_accepted()
        called.set()

    server = ActionServer("fib", Fibonacci, accept, node=node)
    client = client_of(robot)
    uuid = bytes([1] * 16)
    assert client.accepted(uuid, Fibonacci.Goal()) is not None
    result = client.result(uuid)
    assert client.end_of(client.result(bytes(16)))[0] == 0  # so the one before has arrived too
    assert called.wait(60.0)  # the client hears of it before the callback has returned
    node.close()
    assert client.end_of(result)[0] == 6
    assert server.stopped
    assert server.keeper.goals.find(uuid.hex()).status is Status.ABORTED
