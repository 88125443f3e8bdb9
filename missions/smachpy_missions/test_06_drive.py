"""Lesson 6: a scripted robot instead of a real one; 600 s of driving take no time."""

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from smachpy_missions.lesson_06_drive import there_and_back


@pytest.fixture
def robot(mission):
    here = Odometry()
    here.pose.pose.orientation.w = 1.0
    mission.topic("odom", Odometry).publish(here, latch=True)
    return mission.action_server("move_base", MoveBaseAction)


def test_it_stops_after_three_seconds(mission, robot):
    robot.default_result(duration=10)
    run = mission(there_and_back())
    run.assert_path(["REMEMBER", "GO", "COME_BACK"])
    assert run.outcomes("GO") == ("stopped",)


def test_a_near_place_is_reached(mission, robot):
    robot.default_result(duration=1)
    assert mission(there_and_back()).outcomes("GO") == ("succeeded",)
