#!/usr/bin/env python
import rospy
import smach
import tf
import tf2_ros
import math
from tf.transformations import quaternion_from_euler, euler_from_quaternion
from geometry_msgs.msg import PoseStamped, Quaternion, PointStamped


class Where(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["here", "lost"], output_keys=["pose"])
        self.listener = tf.TransformListener()

    def execute(self, ud):
        try:
            self.listener.waitForTransform("/map", "/base_link", rospy.Time(0), rospy.Duration(4.0))
            (trans, rot) = self.listener.lookupTransform("/map", "/base_link", rospy.Time(0))
        except (
            tf.Exception,
            tf.LookupException,
            tf.ConnectivityException,
            tf.ExtrapolationException,
        ):
            return "lost"
        yaw = euler_from_quaternion(rot)[2]
        pose = PoseStamped()
        pose.header.frame_id = "base_link"
        pose.pose.position.x = 1.0
        pose.pose.orientation = Quaternion(*quaternion_from_euler(0, 0, math.pi / 2))
        ud.pose = self.listener.transformPose("map", pose)
        return "here" if abs(yaw - 1.0) < 1e-6 and trans[0] == 2.0 else "lost"


def send(event):
    br.sendTransform(
        (2.0, 0.0, 0.0), quaternion_from_euler(0, 0, 1.0), rospy.Time.now(), "base_link", "map"
    )


rospy.init_node("where")
br = tf.TransformBroadcaster()
sm = smach.StateMachine(outcomes=["here", "lost"])
with sm:
    smach.StateMachine.add("WHERE", Where(), transitions={"here": "here", "lost": "lost"})
timer = rospy.Timer(rospy.Duration(0.1), send)
outcome = sm.execute()
timer.shutdown()
assert outcome == "here"
