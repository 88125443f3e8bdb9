"""A mission whose callbacks block, and its robot in a process of its own: the cancel arrives."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport
from smachpy import SimpleActionState, StateMachine

LONG_S = 60.0

SERVER = """
import sys, time
from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback

def drive(goal):
    number = 0
    while not server.wait_preempt(goal.goal / 1000):
        server.publish_feedback(TestFeedback(number))
        number += 1
    print(time.monotonic(), flush=True)
    server.set_preempted()

server = SimpleActionServer("blocked_mission", TestAction, drive, auto_start=False)
server.start()
print("ready", flush=True)
sys.stdin.read()
server.stop()
"""


class Robot:
    """The server's process."""

    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, "-c", SERVER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ,
        )
        assert self.line() == "ready"

    def line(self):
        ready, _, _ = select.select([self.process.stdout], [], [], LONG_S)
        assert ready
        return self.process.stdout.readline().strip()

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


@pytest.fixture
def robot():
    robot = Robot()
    yield robot
    robot.close()


@pytest.fixture
def mission():
    transport = ZenohTransport()
    with Node("mission", transport=transport) as node:
        yield node
    transport.close()


@pytest.mark.zenoh
@pytest.mark.parametrize("feedback_ms", [1, 50])
def test_preempt_reaches_the_robot_while_feedback_cb_blocks(robot, mission, feedback_ms):
    clock = mission.clock
    inside, release = clock.event(), clock.event()

    def block(_userdata, _feedback):
        inside.set()
        release.wait(LONG_S)

    state = SimpleActionState(
        "blocked_mission", Action, goal=Goal(feedback_ms), feedback_cb=block, node=mission
    )
    machine = StateMachine(["succeeded", "aborted", "preempted"])
    with machine:
        machine.add("DRIVE", state)
    running = clock.spawn(machine.execute, name="mission")
    assert inside.wait(LONG_S)
    asked = time.monotonic()
    machine.request_preempt()
    heard_s = float(robot.line()) - asked
    print(f"heard {heard_s * 1000:.1f} ms after the preempt")
    assert not release.is_set()
    release.set()
    assert running.join(LONG_S)


@pytest.mark.slow
@pytest.mark.zenoh
def test_cancel_reaches_the_robot_while_a_client_callback_blocks_and_the_goal_ends(robot, mission):
    clock = mission.clock
    inside, release = clock.event(), clock.event()

    def block(_feedback):
        inside.set()
        release.wait(LONG_S)

    client = SimpleActionClient("blocked_mission", Action, node=mission)
    assert client.wait_for_server(LONG_S)
    client.send_goal(Goal(1), feedback_cb=block)
    assert inside.wait(LONG_S)
    asked = time.monotonic()
    client.cancel_goal()
    print(f"heard {(float(robot.line()) - asked) * 1000:.1f} ms after the cancel")
    assert client.wait_for_result(LONG_S)
    release.set()
