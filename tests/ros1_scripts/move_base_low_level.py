#!/usr/bin/env python
import rospy
import smach
import smach_ros

import actionlib
from actionlib import ActionClient, CommState, TerminalState
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal


class Drive(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["there", "failed"])
        self.done = False

    def transition_cb(self, gh):
        if gh.get_comm_state() == CommState.DONE:
            self.result = gh.get_terminal_state()
            self.done = True

    def execute(self, ud):
        client = ActionClient("move_base", MoveBaseAction)
        client.wait_for_server()
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = "map"
        goal.target_pose.pose.position.x = 10.5
        goal.target_pose.pose.position.y = 8.0
        goal.target_pose.pose.orientation.w = 1.0
        gh = client.send_goal(goal, self.transition_cb)
        while not self.done and not rospy.is_shutdown():
            rospy.sleep(0.1)
        return "there" if self.result == TerminalState.SUCCEEDED else "failed"


rospy.init_node("low_level")
sm = smach.StateMachine(outcomes=["there", "failed"])
with sm:
    smach.StateMachine.add("DRIVE", Drive())
sm.execute()
