#!/usr/bin/env python
# Frames sent and followed by tf, with its exceptions, a point in another frame, a moving listener.
import math

import rospy
import smach
import tf
from geometry_msgs.msg import PointStamped, Twist
from tf import TransformBroadcaster, TransformListener
from tf.transformations import *


class Follow(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["near", "lost", "preempted"])
        self.listener = tf.TransformListener(True, rospy.Duration(10.0))
        self.pub = rospy.Publisher("cmd_vel", Twist, queue_size=5)

    def execute(self, userdata):
        rate = rospy.Rate(10.0)
        for _ in range(100):
            if self.preempt_requested():
                return "preempted"
            try:
                (trans, rot) = self.listener.lookupTransform("/turtle2", "/turtle1", rospy.Time(0))
            except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException):
                rate.sleep()
                continue
            cmd = Twist()
            cmd.angular.z = 4 * math.atan2(trans[1], trans[0])
            cmd.linear.x = 0.5 * math.sqrt(trans[0] ** 2 + trans[1] ** 2)
            self.pub.publish(cmd)
            point = PointStamped()
            point.header.frame_id = "turtle1"
            point.point.x = 1.0
            there = self.listener.transformPoint("turtle2", point)
            roll, pitch, yaw = tf.transformations.euler_from_quaternion(rot)
            rospy.loginfo("%.2f %.2f %.2f", there.point.x, there.point.y, yaw)
            assert self.listener.frameExists("turtle1")
            return "near"
        return "lost"


def main():
    rospy.init_node("tf_turtle")
    br = TransformBroadcaster()

    def send(event):
        now = rospy.Time.now()
        br.sendTransform((2.0, 1.0, 0), quaternion_from_euler(0, 0, 0.5), now, "turtle1", "world")
        br.sendTransform((0.0, 1.0, 0), quaternion_from_euler(0, 0, 0), now, "turtle2", "world")

    rospy.Timer(rospy.Duration(0.1), send)
    sm = smach.StateMachine(outcomes=["done", "failed"])
    with sm:
        smach.StateMachine.add(
            "FOLLOW", Follow(), {"near": "done", "lost": "failed", "preempted": "failed"}
        )
    sm.execute()


if __name__ == "__main__":
    main()
