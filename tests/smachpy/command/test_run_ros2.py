"""Missions at a robot of ROS 2's wire: router, robot and mission in processes of their own."""

from __future__ import annotations

import contextlib
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.free_port import free_port

PROGRAMS = Path(sys.executable).parent
# `smachpy doctor`, for which a busy computer is no slow link.
DOCTOR = """
import sys
from actionlib_core.wire.ros2 import diagnosis
from smachpy.command import doctor, main

doctor.ASK_S = doctor.LIST_S = diagnosis.SLOW_S = 60.0
sys.exit(main())
"""
MISSION = """
import smachpy
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose, Spin
from smachpy.states import nav2_active

goal = NavigateToPose.Goal()
goal.pose.header.frame_id = "map"
goal.pose.pose.position.x = 10.2
goal.pose.pose.position.y = 7.1
sm = smachpy.StateMachine(["succeeded", "aborted", "preempted"], name="ERRAND")
sm.add("START_UP", nav2_active(timeout=60.0), {"succeeded": "GO"})
go = smachpy.SimpleActionState("navigate_to_pose", NavigateToPose, goal=goal)
sm.add("GO", go, {"succeeded": "TURN"})
sm.add("TURN", smachpy.SimpleActionState("spin", Spin, goal=Spin.Goal(target_yaw=0.3)))
"""


@contextlib.contextmanager
def program(word, *argv):
    """A program that has printed a line with a word in it."""
    process = subprocess.Popen(
        [PROGRAMS / argv[0], *argv[1:]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        line = process.stdout.readline()
        assert word in line, line + process.stdout.read()
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=250)


def run(*argv, code=0):
    done = subprocess.run(
        [PROGRAMS / argv[0], *argv[1:]], capture_output=True, text=True, timeout=250, check=False
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(900)
def test_missions_drive_a_ros2_robot(tmp_path, monkeypatch):
    for name in ("SMACHPY_CONFIG", "SMACHPY_ROS2", "SMACHPY_ROS2_DISTRO"):
        monkeypatch.delenv(name, raising=False)
    router = f"tcp/127.0.0.1:{free_port()}"
    robot = ("--ros2", router, "--domain", "42")
    mission = tmp_path / "errand.py"
    mission.write_text(MISSION)
    with (
        program("listens", "actionlib", "router", "--listen", router),
        program("ready", "smachpy", "robot", *robot),
    ):
        found = json.loads(run(sys.executable, "-c", DOCTOR, "doctor", *robot, "--json"))
        assert {finding["level"] for finding in found} == {"ok"}
        names = {
            action["name"] for action in json.loads(run("actionlib", *robot, "list", "--json"))
        }
        assert {"/navigate_to_pose", "/spin"} <= names
        scan = run("actionlib", *robot, "topic", "echo", "scan", "--once", "--timeout", "60")
        assert "ranges" in scan
        run("smachpy", "run", str(mission), *robot, "--plain")
        # One that was written for ROS 1: its odometry and move_base are the robot's.
        run("smachpy", "run", "there_and_back", *robot, "--plain", "--", "10.4", "7.1")
        other = json.loads(
            run(sys.executable, "-c", DOCTOR, "doctor", *robot[:2], "--json", code=1)
        )
        assert other[-1]["what"] == "nodes"
        assert "42" in other[-1]["way_out"]
