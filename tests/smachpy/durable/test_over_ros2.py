"""Durable missions and action servers on the ROS 2 wire: real processes, killed."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from actionlib_core import ActionClient
from actionlib_core.clock import RealClock
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from tests.ros2_robot import DOMAIN, Ros2Robot
from tests.ros2_server import Ros2Server

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(900)]

MISSION = """
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci
from smachpy import SimpleActionState, StateMachine


def done(userdata, status, result):
    print("sequence", list(result.sequence), flush=True)


def mission():
    machine = StateMachine(["succeeded", "aborted", "preempted"], name="ERRAND")
    with machine:
        StateMachine.add(
            "GO",
            SimpleActionState("fib", Fibonacci, goal=Fibonacci.Goal(order=3), result_cb=done),
        )
    return machine
"""
SERVER = """
import sys
from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.ros2.test_msgs.action import Fibonacci


def run(goal):
    if server.is_resumed():
        server.set_succeeded(Fibonacci.Result(sequence=[goal.order]))
    else:
        print("begun", flush=True)
        server.wait_preempt(200.0)


server = SimpleActionServer(
    "fib", Fibonacci, run, auto_start=False, durable="goals.db", on_restart=sys.argv[1]
)
server.start()
server.wait()
"""
SUCCEEDED = 4


@pytest.fixture
def robot() -> Iterator[Ros2Robot]:
    made = Ros2Robot(RealClock())
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def programs(
    robot: Ros2Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[contextlib.ExitStack]:
    """Where started programs are put; each is killed at the end."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SMACHPY_ROS2", robot.endpoint)
    monkeypatch.setenv("SMACHPY_ROS2_DOMAIN", str(DOMAIN))
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "kilted")
    with contextlib.ExitStack() as left:
        yield left


def start(programs: contextlib.ExitStack, *words: str) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    programs.callback(kill, process)
    return process


def kill(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    assert process.stdout is not None
    process.stdout.close()


@pytest.mark.slow
@pytest.mark.parametrize("ends", ["later", "meanwhile"])
def test_a_killed_mission_follows_its_goal(
    robot: Ros2Robot, programs: contextlib.ExitStack, tmp_path: Path, ends: str
) -> None:
    (tmp_path / "errand.py").write_text(MISSION)
    command = ("-m", "smachpy.command", "run", "errand.py", "--durable", "--plain")
    session = robot.session()
    server = Ros2Server(session, robot.clock, "fib", Fibonacci, domain=DOMAIN, distro="kilted")
    robot.left.callback(server.close)
    killed = start(programs, *command)
    server.wait(lambda: any(server.asked.values()), 60.0)
    kill(killed)
    (uuid,) = server.sent
    server.asked.clear()
    result = server.parts.get_result.response().result
    result.sequence = [0, 1, 1]
    if ends == "meanwhile":
        server.set_state(uuid, SUCCEEDED)
        server.on_result = lambda query, _: server.answer_result(query, SUCCEEDED, result)
    goes_on = start(programs, *command)
    if ends == "later":
        server.wait(lambda: server.asked.get(uuid), 60.0)
        server.end(uuid, SUCCEEDED, result)
    output, _ = goes_on.communicate(timeout=60.0)
    assert goes_on.returncode == 0, output
    assert "sequence [0, 1, 1]" in output
    assert (server.sent, server.cancels, server.problems) == ([uuid], [], [])


@pytest.mark.parametrize(
    ("on_restart", "status", "sequence"),
    [("abort", Status.ABORTED, []), ("resume", Status.SUCCEEDED, [3])],
    ids=["abort", "resume"],
)
def test_a_killed_durable_server_keeps_its_goal(
    robot: Ros2Robot,
    programs: contextlib.ExitStack,
    on_restart: str,
    status: Status,
    sequence: list[int],
) -> None:
    command = ("-c", SERVER, on_restart)
    sender = ActionClient("fib", Fibonacci, node=robot.node("sender"))
    killed = start(programs, *command)
    assert sender.wait_for_server(60)
    goal_id = sender.send_goal(Fibonacci.Goal(order=3)).get_goal_id()
    assert killed.stdout is not None
    assert killed.stdout.readline() == "begun\n"
    kill(killed)
    start(programs, *command)
    follower = ActionClient("fib", Fibonacci, node=robot.node("follower"))
    assert follower.wait_for_server(60)
    with follower.follow(goal_id, timeout=60) as sent:
        sent.wait()
        assert sent.status == status
        assert list(sent.get_result().sequence) == sequence
