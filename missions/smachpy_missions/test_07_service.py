"""Lesson 7: a scripted service answers, a scripted topic reports when the door is open."""

import pytest

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_msgs.msg import Bool
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy_missions.lesson_07_service import door


@pytest.fixture
def lab(mission):
    mission.action_server("move_base", MoveBaseAction).default_result(duration=10)
    return mission.service_server("doors/lab/set", SetBool)


def test_it_drives_in_when_the_door_is_open(mission, lab):
    lab.reply({"success": True})
    mission.topic("doors/lab/open", Bool).publish_at(13.0, {"data": True})
    run = mission(door())
    run.assert_path(["APPROACH", "OPEN", "WAIT", "ENTER"])


def test_a_door_that_refuses_is_asked_three_times(mission, lab):
    lab.default_response({"success": False})
    mission(door()).assert_outcome("closed")
    assert len(lab.requests) == 3
