#!/usr/bin/env python
import roslib

roslib.load_manifest("arm")
import rospy, smach, math
import PyKDL
from tf_conversions import posemath
from geometry_msgs.msg import Pose


class Approach(smach.State):
    def __init__(self):
        smach.State.__init__(self, ["ok", "bad"])

    def execute(self, ud):
        pose = Pose()
        pose.position.x = 1.0
        pose.orientation.w = 1.0
        frame = posemath.fromMsg(pose) * PyKDL.Frame(
            PyKDL.Rotation.RPY(0, 0, math.pi / 2), PyKDL.Vector(0, 2, 0)
        )
        point = frame * PyKDL.Vector(1, 0, 0)
        roll, pitch, yaw = frame.M.GetRPY()
        back = posemath.toMsg(frame.Inverse() * frame)
        good = (
            PyKDL.Equal(point, PyKDL.Vector(1, 3, 0))
            and abs(yaw - math.pi / 2) < 1e-9
            and abs(back.orientation.w - 1) < 1e-9
        )
        return "ok" if good else "bad"


rospy.init_node("approach")
sm = smach.StateMachine(["ok", "bad"])
with sm:
    smach.StateMachine.add("APPROACH", Approach())
assert sm.execute() == "ok"
