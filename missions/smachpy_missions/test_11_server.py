"""Lesson 11: client, server and robot are in one test."""

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy_missions.lesson_11_server import look_at


@pytest.fixture
def robot(mission):
    robot = mission.action_server("move_base", MoveBaseAction)
    robot.default_result(duration=10)
    return robot


def test_a_goal_runs_the_machine(mission, robot):
    mission(look_at()).assert_outcome("succeeded")
    assert len(robot.goals) == 2  # the drive and the turn


def test_a_cancel_reaches_the_drive(mission, robot):
    mission.preempt(on="SEND", after=3.0)
    run = mission(look_at())
    run.assert_outcome("preempted")
    assert len(robot.cancelled) == 1
