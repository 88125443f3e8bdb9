#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Once(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])

    def execute(self, ud):
        rospy.sleep(1.0)
        return "done"


rospy.init_node("again")
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("ONCE", Once())
rounds = 0
while not rospy.is_shutdown() and rounds < 3:
    sm.execute()
    rounds += 1
