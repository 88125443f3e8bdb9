"""An action server's process is killed under a running mission."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from actionlib_core.config import load_config
from actionlib_core.interfaces.actionlib.msg import TestAction as Action
from actionlib_core.interfaces.actionlib.msg import TestGoal as Goal
from actionlib_core.node import Node
from actionlib_core.transport.zenoh import ZenohTransport
from smachpy import SimpleActionState, StateMachine, events

SERVER = """
from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction, TestFeedback

def run(goal):
    server.publish_feedback(TestFeedback(1))
    server.wait_preempt(60.0)

server = SimpleActionServer("killed_server", TestAction, run, auto_start=False)
server.start()
server.wait()
"""


@pytest.mark.zenoh
def test_kill_9_ends_the_goal_at_once_and_a_new_server_is_used(tmp_path, monkeypatch):
    file = tmp_path / "config.yaml"
    file.write_text(f"domain: {load_config().domain}\nlease: 100.0\n")
    monkeypatch.setenv("SMACHPY_CONFIG", str(file))
    transport = ZenohTransport()
    node = Node("mission", transport=transport)
    killed_at = []

    def start():
        return subprocess.Popen([sys.executable, "-c", SERVER])

    def kill(event):
        if isinstance(event, events.GoalFeedback):
            killed_at.append(time.monotonic())
            os.kill(process.pid, signal.SIGKILL)

    machine = StateMachine(["succeeded", "aborted", "preempted"])
    with machine:
        machine.add("DRIVE", SimpleActionState("killed_server", Action, goal=Goal(1), node=node))
    machine.subscribe(kill)
    try:
        for _ in range(2):
            process = start()
            assert machine.execute() == "aborted"
            took_s = time.monotonic() - killed_at[-1]
            process.wait(60.0)
            assert (
                took_s < 50.0
            )  # by its token, not by the silence of its link, which takes the lease
            print(f"aborted {took_s * 1000:.1f} ms after kill -9")
    finally:
        process.kill()
        process.wait(60.0)
        node.close()
        transport.close()
