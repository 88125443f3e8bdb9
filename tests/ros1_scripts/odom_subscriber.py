#!/usr/bin/env python
import rospy
import smach
import smach_ros

from nav_msgs.msg import Odometry
from geometry_msgs.msg import PoseStamped
import actionlib
from move_base_msgs.msg import *


class Position(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["known", "unknown"], output_keys=["x"])
        self.msg = None
        self.sub = rospy.Subscriber("odom", Odometry, self.callback)

    def callback(self, msg):
        self.msg = msg

    def execute(self, ud):
        r = rospy.Rate(10)
        for i in range(50):
            if self.msg is not None:
                ud.x = self.msg.pose.pose.position.x
                self.sub.unregister()
                return "known"
            r.sleep()
        return "unknown"


rospy.init_node("position")
client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
client.wait_for_server(rospy.Duration(30))
sm = smach.StateMachine(outcomes=["known", "unknown"])
with sm:
    smach.StateMachine.add("POSITION", Position())
assert sm.execute() == "known"
