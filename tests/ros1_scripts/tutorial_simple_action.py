#!/usr/bin/env python
import roslib

roslib.load_manifest("smach_ros")
import rospy
import rostest
import actionlib
from actionlib import *
from actionlib.msg import *
from smach import *
from smach_ros import *


class TestServer:
    def __init__(self, name):
        self._sas = SimpleActionServer(name, TestAction, execute_cb=self.execute_cb)

    def execute_cb(self, msg):
        if msg.goal == 0:
            self._sas.set_succeeded()
        elif msg.goal == 1:
            self._sas.set_aborted()
        elif msg.goal == 2:
            self._sas.set_preempted()


def main():
    rospy.init_node("smach_usecase_step_02")
    server = TestServer("test_action")
    sm0 = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    with sm0:
        StateMachine.add(
            "GOAL_DEFAULT",
            SimpleActionState("test_action", TestAction),
            {"succeeded": "GOAL_STATIC"},
        )
        StateMachine.add(
            "GOAL_STATIC",
            SimpleActionState("test_action", TestAction, goal=TestGoal(goal=1)),
            {"aborted": "GOAL_CB"},
        )

        def goal_callback(userdata, default_goal):
            goal = TestGoal()
            goal.goal = 2
            return goal

        StateMachine.add(
            "GOAL_CB",
            SimpleActionState("test_action", TestAction, goal_cb=goal_callback),
            {"aborted": "succeeded", "preempted": "succeeded"},
        )
    sis = IntrospectionServer("smach_usecase_01", sm0, "/USE_CASE")
    sis.start()
    outcome = sm0.execute()
    assert GoalStatus.SUCCEEDED == 3
    rospy.signal_shutdown("All done.")


if __name__ == "__main__":
    main()
