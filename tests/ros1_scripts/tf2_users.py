#!/usr/bin/env python3
import rospy
import smach
import tf2_ros
import tf2_geometry_msgs
import sensor_msgs.point_cloud2 as pc2
from dynamic_reconfigure.msg import Config, DoubleParameter
from geometry_msgs.msg import TransformStamped, PointStamped
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointField
from std_msgs.msg import Header
from tf2_geometry_msgs.tf2_geometry_msgs import do_transform_pose
from tf2_ros.buffer import Buffer


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
cloud = pc2.create_cloud_xyz32(Header(frame_id="map"), [(1, 2, 3), (float("nan"), 5, 6)])
assert list(pc2.read_points(cloud, field_names=("z", "x"), skip_nans=True)) == [(3.0, 1.0)]
assert point_cloud2.read_points_list(cloud, uvs=[[0, 0]])[0].y == 2.0
fields = [PointField("n", 2, PointField.UINT16, 1), PointField("d", 8, PointField.FLOAT64, 1)]
assert list(pc2.read_points(pc2.create_cloud(Header(), fields, [(7, 0.5), (8, 1.5)]), ["d"])) == [(0.5,), (1.5,)]
assert Config(doubles=[DoubleParameter("gain", 2.0)]).doubles[0].value == 2.0
buffer = Buffer(rospy.Duration(1200.0))
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
