#!/usr/bin/env python
# SimpleActionClient by hand inside a state.
import rospy
import smach
import actionlib
from actionlib_msgs.msg import *
from move_base_msgs.msg import *
from geometry_msgs.msg import *


class GoTo(smach.State):
    def __init__(self, x, y):
        smach.State.__init__(self, outcomes=["succeeded", "failed"])
        self.client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        self.client.wait_for_server()
        self.x, self.y = x, y

    def execute(self, userdata):
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.header.stamp = rospy.get_rostime()
        goal.target_pose.pose.position.x = self.x
        goal.target_pose.pose.position.y = self.y
        goal.target_pose.pose.orientation.w = 1.0
        self.client.send_goal(goal, feedback_cb=self.feedback)
        self.client.wait_for_result(rospy.Duration.from_sec(120.0))
        if self.client.get_state() == actionlib.GoalStatus.SUCCEEDED:
            return "succeeded"
        return "failed"

    def feedback(self, fb):
        rospy.loginfo_throttle(1, "at %.1f" % fb.base_position.pose.position.x)


if __name__ == "__main__":
    rospy.init_node("go_there")
    sm = smach.StateMachine(outcomes=["done", "broken"])
    with sm:
        smach.StateMachine.add("THERE", GoTo(11.0, 8.0), {"succeeded": "BACK", "failed": "broken"})
        smach.StateMachine.add("BACK", GoTo(10.0, 8.0), {"succeeded": "done", "failed": "broken"})
    sm.execute()
