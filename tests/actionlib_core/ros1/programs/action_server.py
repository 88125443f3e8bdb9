"""A SimpleActionServer of ROS 1: `NAME NODE [mute]`. Doubles the goal; one below 0 runs until it is cancelled."""

import sys

import actionlib
import rospy
from actionlib.msg import TestAction, TestFeedback, TestResult

name, node = sys.argv[1:3]
rospy.init_node(node)


def execute(goal):
    server.publish_feedback(TestFeedback(goal.goal))
    while goal.goal < 0 and not rospy.is_shutdown():
        if server.is_preempt_requested():
            server.set_preempted(TestResult(-1), "preempted by ROS 1")
            return
        rospy.sleep(0.01)
    server.set_succeeded(TestResult(2 * goal.goal), "done by ROS 1")


if "mute" in sys.argv:  # its result messages are lost
    actionlib.ActionServer.publish_result = lambda *_: None
server = actionlib.SimpleActionServer(name, TestAction, execute, auto_start=False)
server.start()
print("ready", flush=True)
rospy.spin()
