"""Lesson 10: a test answers instead of a person, or lets the question time out."""

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import String
from smachpy_missions.lesson_10_ask import asking


@pytest.fixture
def robot(mission):
    robot = mission.action_server("move_base", MoveBaseAction)
    robot.reply(status="aborted", duration=10)  # the first way is blocked
    robot.default_result(duration=10)
    return robot


def test_retry_drives_again(mission, robot):
    mission.topic("operator/answer", String).publish_at(15.0, {"data": "retry"})
    run = mission(asking())
    run.assert_path(["DRIVE", "ASK", "DRIVE"])


def test_without_an_answer_it_comes_home(mission, robot):
    run = mission(asking(patience=60.0))
    run.assert_outcome("returned")
    assert run.duration == 10 + 60 + 10
