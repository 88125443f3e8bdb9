#!/usr/bin/env python3
import rospy
import smach
import tf2_ros
import tf2_geometry_msgs
from geometry_msgs.msg import TransformStamped, PointStamped


class Look(smach.State):
    def __init__(self, buffer):
        smach.State.__init__(self, outcomes=["seen", "unseen"])
        self.buffer = buffer

    def execute(self, ud):
        point = PointStamped()
        point.header.frame_id = "camera"
        point.point.x = 1.0
        try:
            moved = self.buffer.transform(point, "map", rospy.Duration(1))
            t = self.buffer.lookup_transform("map", "camera", rospy.Time(), rospy.Duration(1.0))
            again = tf2_geometry_msgs.do_transform_point(point, t)
        except (
            tf2_ros.LookupException,
            tf2_ros.ConnectivityException,
            tf2_ros.ExtrapolationException,
        ):
            return "unseen"
        return "seen" if moved.point.x == again.point.x == 4.0 else "unseen"


rospy.init_node("look")
buffer = tf2_ros.Buffer(rospy.Duration(1200.0))
listener = tf2_ros.TransformListener(buffer)
t = TransformStamped()
t.header.stamp = rospy.Time.now()
t.header.frame_id = "map"
t.child_frame_id = "camera"
t.transform.translation.x = 3.0
t.transform.rotation.w = 1.0
broadcaster = tf2_ros.StaticTransformBroadcaster()
broadcaster.sendTransform(t)
sm = smach.StateMachine(outcomes=["seen", "unseen"])
with sm:
    smach.StateMachine.add("LOOK", Look(buffer))
assert sm.execute() == "seen"
