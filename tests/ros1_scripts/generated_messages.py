#!/usr/bin/env python
# genpy's times, messages by name, fields by loops, copies of goals.
import copy
import importlib
import math

import genpy
import roslib.message
import rospy
import smach
from geometry_msgs.msg import *
from move_base_msgs.msg import *
from rospy import Duration, loginfo as info
from tf.transformations import euler_from_quaternion, quaternion_from_euler

Twist_ = roslib.message.get_message_class("geometry_msgs/Twist")


def goal_at(x, y, yaw):
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    goal.target_pose.header.stamp = rospy.Time.now()
    goal.target_pose.pose = Pose(Point(x, y, 0), Quaternion(*quaternion_from_euler(0, 0, yaw)))
    return goal


class Plan(smach.State):
    def __init__(self):
        smach.State.__init__(self, ["planned"], output_keys=["goals"])

    def execute(self, userdata):
        first = goal_at(1.0, 2.0, math.pi / 2)
        second = copy.deepcopy(first)
        second.target_pose.pose.position.x += 1
        assert first != second
        userdata.goals = [first, second]
        return "planned"


class Look(smach.State):
    def __init__(self):
        smach.State.__init__(self, ["seen"], input_keys=["goals"])

    def execute(self, userdata):
        for goal in userdata.goals:
            q = goal.target_pose.pose.orientation
            yaw = euler_from_quaternion((q.x, q.y, q.z, q.w))[2]
            info("%.2f %.2f", goal.target_pose.pose.position.x, yaw)
        twist = Twist_()
        for name in twist.__slots__:
            for axis in getattr(twist, name).__slots__:
                setattr(getattr(twist, name), axis, 0.5)
        info("%s %s", twist._type, twist.linear.x)
        module = importlib.import_module("std_msgs.msg")
        assert isinstance(Duration(1.5), genpy.Duration)
        assert genpy.Time(1, 5) < genpy.Time.from_sec(2)
        try:
            module.Int8(data="text").serialize(open("/dev/null", "wb"))
        except (genpy.SerializationError, genpy.MessageException, TypeError) as error:
            info("%s", type(error).__name__)
        return "seen"


rospy.init_node("goals")
sm = smach.StateMachine(["over"])
with sm:
    smach.StateMachine.add("PLAN", Plan(), {"planned": "LOOK"})
    smach.StateMachine.add("LOOK", Look(), {"seen": "over"})
sm.execute()
