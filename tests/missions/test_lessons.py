"""The lessons that no file of their own tests, and what holds for all of them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import missions
from actionlib_core import ActionClient, Node
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from actionlib_core.interfaces.sensor_msgs.msg import LaserScan
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool, SetBoolResponse
from missions.lesson_4_door import door
from missions.lesson_5_inspect import inspect
from missions.lesson_6_server import go_and_look, look_at, offer
from missions.lesson_7_shuttle import shuttle
from smachpy.checks import check
from smachpy.exceptions import MissionError
from smachpy.states import Pose2D, goal_at

LESSONS = sorted(Path(missions.__file__).parent.glob("lesson_*.py"))
DRIVE_S = 10.0


@pytest.mark.parametrize("file", LESSONS, ids=lambda file: file.stem)
def test_a_lesson_is_one_screen_of_public_api(file):
    text = file.read_text()
    assert len(text.splitlines()) <= 70
    assert not re.search(r"noqa|type: ignore|ignore\[", text)
    tree = ast.parse(text)
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    private = {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    assert not any(name.startswith("missions") for name in imported)
    assert not any(name.startswith("_") for name in private)


def test_the_lessons_are_seven():
    assert [file.stem.split("_")[1] for file in LESSONS] == list("1234567")


@pytest.fixture
def drives(mission):
    server = mission.action_server("move_base", MoveBaseAction)
    server.default_result(duration=DRIVE_S)
    return server


# -- 4 the door ------------------------------------------------------------------------------------


@pytest.fixture
def lab(mission):
    return mission.service_server("doors/lab/set", SetBool)


def opened(mission, *, is_open, at=0.0):
    mission.topic("doors/lab/open", Bool).publish_at(at, Bool(data=is_open))


def test_it_drives_through_a_door_that_opens(mission, drives, lab):
    lab.reply(SetBoolResponse(success=True))
    opened(mission, is_open=True, at=DRIVE_S + 3.0)
    run = mission(door())
    run.assert_outcome("succeeded")
    run.assert_path(["APPROACH", "OPEN", "WAIT", "ENTER"])
    assert run.duration == pytest.approx(2 * DRIVE_S + 3.0)


def test_a_door_that_refuses_is_asked_three_times(mission, drives, lab):
    for _ in range(3):
        lab.reply(SetBoolResponse(success=False))
    mission(door()).assert_outcome("closed")
    assert len(lab.requests) == 3


def test_a_door_that_stays_shut_is_not_driven_through(mission, drives, lab):
    lab.reply(SetBoolResponse(success=True))
    opened(mission, is_open=False, at=DRIVE_S + 3.0)
    run = mission(door(patience=20.0))
    run.assert_outcome("closed")
    assert run.duration == pytest.approx(DRIVE_S + 20.0)
    assert len(drives.goals) == 1


@pytest.mark.parametrize("state", ["APPROACH", "WAIT", "ENTER"])
def test_the_way_through_the_door_is_preempted_anywhere(mission, drives, lab, state):
    lab.reply(SetBoolResponse(success=True))
    if state == "ENTER":
        opened(mission, is_open=True, at=DRIVE_S + 3.0)
    mission.preempt(on=state, after=1.0)
    mission(door()).assert_outcome("preempted")


# -- 5 the Iterator --------------------------------------------------------------------------------


def test_it_measures_at_every_waypoint_that_it_can_get_to(mission, drives):
    kitchen = 4.6
    drives.reply_conditionally(
        lambda goal: goal.target_pose.pose.position.x == kitchen, status="aborted"
    )
    scan = LaserScan(range_max=3.0, ranges=[2.0, 0.754, 1.5])
    mission.topic("scan", LaserScan).publish_every(0.5, [scan] * 1000)
    machine = inspect()
    mission(machine).assert_outcome("incomplete")
    assert machine.userdata.room == dict.fromkeys(
        ("office 1", "open plan", "print room", "lab"), 0.75
    )
    assert len(drives.goals) == 6  # five places, one of them tried twice


def test_without_a_scanner_nothing_is_measured(mission, drives):
    machine = inspect()
    mission(machine).assert_outcome("incomplete")
    assert machine.userdata.room == {}


# -- 6 the action server ---------------------------------------------------------------------------


def test_a_goal_runs_the_machine_and_its_feedback_comes_through(mission, drives):
    there = MoveBaseFeedback()
    there.base_position.pose.position.x = 3.0
    drives.default_result(duration=DRIVE_S, feedback=[there])
    run = mission(look_at())
    run.assert_outcome("succeeded")
    assert len(drives.goals) == 3  # the drive and two turns
    assert drives.goals[0].target_pose.pose.position.x == 11.5
    heard = [e.feedback for e in run.events if type(e).__name__ == "GoalFeedback"]
    assert 3.0 in {feedback.base_position.pose.position.x for feedback in heard}


def test_a_cancel_preempts_the_machine_and_its_drive(mission, drives):
    mission.preempt(on="SEND", after=3.0)
    run = mission(look_at())
    run.assert_outcome("preempted")
    assert run.duration < DRIVE_S
    assert len(drives.goals) == 1


def test_a_preempt_that_ends_the_machine_at_once_is_no_failure(mission):
    # Nobody serves the drive: the machine ends before SEND's cancel reaches its server.
    mission.preempt(on="SEND", after=3.0)
    mission(look_at()).assert_outcome("preempted")


def test_the_machine_that_is_served_has_no_problems():
    check(go_and_look()).assert_ok()


def test_the_server_takes_one_goal_after_the_other(mission, drives):
    server = offer()
    try:
        with Node("other", transport=mission.network.session(), clock=mission.clock) as node:
            client = ActionClient("look_at", MoveBaseAction, node=node)
            for _ in range(2):
                with client.send(goal_at(Pose2D(1.0, 2.0, 0.0)), timeout=100.0) as goal:
                    goal.result()
            client.stop()
    finally:
        server.stop()
    assert len(drives.goals) == 6


# -- 7 async and typed -----------------------------------------------------------------------------


def test_the_shuttle_adds_up_the_way(mission, drives):
    steps = [MoveBaseFeedback() for _ in range(3)]
    for x, feedback in enumerate(steps):
        feedback.base_position.pose.position.x = float(x)
    drives.default_result(duration=DRIVE_S, feedback=steps)
    machine = shuttle(trips=3)
    mission(machine).assert_outcome("succeeded")
    assert machine.userdata.trips == 3
    assert machine.userdata.metres == 3 * 2.0
    assert len({goal.target_pose.pose.position.x for goal in drives.goals}) == 2


def test_a_preempt_of_the_shuttle_cancels_its_goal(mission, drives):
    mission.preempt(on="DRIVE", after=3.0)
    run = mission(shuttle())
    run.assert_outcome("preempted")
    assert run.goals_left == ()
    assert run.duration < DRIVE_S


def test_a_shuttle_that_cannot_get_there_fails(mission, drives):
    drives.default_result(status="aborted")
    mission(shuttle()).assert_outcome("failed")


def test_a_shuttle_without_trips_is_refused():
    with pytest.raises(MissionError, match="trips: got 0"):
        shuttle(trips=0)
