"""Lesson 9: one place is out of reach; the others are visited."""

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy_missions.lesson_09_list import inspect


def test_a_place_out_of_reach_is_skipped(mission):
    robot = mission.action_server("move_base", MoveBaseAction)
    robot.reply(status="aborted")  # the first goal
    robot.default_result(duration=10)
    run = mission(inspect())
    run.assert_outcome("succeeded")
    assert run.outcomes("LOOK") == ("aborted", "noted", "noted", "noted", "noted")
