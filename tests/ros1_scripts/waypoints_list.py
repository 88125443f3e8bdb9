#!/usr/bin/env python
import rospy
import smach
import smach_ros

from math import pi
import tf.transformations
import actionlib
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

waypoints = [
    ["one", (10.5, 8.0), 0.0],
    ["two", (11.0, 8.0), pi],
]


class Waypoint(smach.State):
    def __init__(self, position, yaw):
        smach.State.__init__(self, outcomes=["success"])
        self.client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        self.client.wait_for_server()
        self.goal = MoveBaseGoal()
        self.goal.target_pose.header.frame_id = "/map"
        self.goal.target_pose.pose.position.x, self.goal.target_pose.pose.position.y = position
        q = tf.transformations.quaternion_from_euler(0, 0, yaw)
        self.goal.target_pose.pose.orientation.z = q[2]
        self.goal.target_pose.pose.orientation.w = q[3]

    def execute(self, userdata):
        self.client.send_goal(self.goal)
        self.client.wait_for_result()
        assert self.client.get_state() == 3, self.client.get_goal_status_text()
        return "success"


if __name__ == "__main__":
    rospy.init_node("patrol")
    patrol = smach.StateMachine(outcomes=["done"])
    with patrol:
        for i, wp in enumerate(waypoints):
            after = waypoints[i + 1][0] if i + 1 < len(waypoints) else "done"
            smach.StateMachine.add(wp[0], Waypoint(wp[1], wp[2]), transitions={"success": after})
    patrol.execute()
