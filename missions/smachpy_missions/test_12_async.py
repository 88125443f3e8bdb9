"""Lesson 12: feedback of a scripted drive; a preempt leaves no goal behind."""

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from smachpy_missions.lesson_12_async import shuttle


def test_feedback_tells_how_far_the_goal_is(mission):
    steps = [MoveBaseFeedback() for _ in range(3)]
    for x, feedback in enumerate(steps):
        feedback.base_position.pose.position.x = 11.5 - x
        feedback.base_position.pose.position.y = 8.0
    robot = mission.action_server("move_base", MoveBaseAction)
    robot.default_result(duration=10, feedback=steps)
    run = mission(shuttle())
    run.assert_outcome("arrived")
    run.assert_userdata(left=2.0)


def test_a_preempt_cancels_the_goal(mission):
    mission.action_server("move_base", MoveBaseAction).default_result(duration=10)
    mission.preempt(on="OUT", after=3.0)
    run = mission(shuttle())
    run.assert_outcome("preempted")
    assert run.goals_left == ()
