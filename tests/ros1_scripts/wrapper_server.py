#!/usr/bin/env python
# a machine as an action server, and a client of it in the same program; with slips in its lists
import rospy
import smach
from smach_ros import ActionServerWrapper
from actionlib import SimpleActionClient, GoalStatus
from actionlib.msg import TestAction, TestGoal, TestResult


class Use(smach.State):
    def __init__(self):
        smach.State.__init__(
            self,
            outcomes=["did_something", "did_something_else"],
            input_keys=["my_goal"],
            output_keys=["my_result"],
        )

    def execute(self, ud):
        ud.my_result = TestResult(ud.my_goal.goal + 1)
        return "did_something"


rospy.init_node("wrapped")
sm = smach.StateMachine(
    outcomes=["did_something", "did_something_else", "aborted", "preempted"],
    input_keys=["my_goal"],
    output_keys=["my_result"],
)
with sm:
    smach.StateMachine.add("USE", Use())
asw = ActionServerWrapper(
    "my_action_server_name",
    TestAction,
    wrapped_container=sm,
    succeeded_outcomes=["did_something", "did_something_else", "not_there"],
    aborted_outcomes=["aborted"],
    preempted_outcomes=["preempted"],
    goal_key="my_goal",
    result_key="my_result",
)
asw.run_server()
client = SimpleActionClient("my_action_server_name", TestAction)
client.wait_for_server()
client.send_goal(TestGoal(41))
client.wait_for_result()
assert client.get_state() == GoalStatus.SUCCEEDED
assert client.get_result().result == 42
rospy.spin()
