#!/usr/bin/env python
import rospy
import rospkg
import roslib.packages
import smach
import os


class Find(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["found", "not_found"])

    def execute(self, ud):
        try:
            path = rospkg.RosPack().get_path("robot_that_nobody_has")
        except rospkg.ResourceNotFound:
            return "not_found"
        return "found"


if __name__ == "__main__":
    rospy.init_node("find")
    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        smach.StateMachine.add("FIND", Find(), transitions={"found": "done", "not_found": "done"})
    sm.execute()
