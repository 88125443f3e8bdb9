#!/usr/bin/env python
import rospy, smach
import dynamic_reconfigure.client


class Slow(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["set", "unset"])

    def execute(self, ud):
        try:
            client = dynamic_reconfigure.client.Client("/move_base/DWAPlannerROS", timeout=2)
            client.update_configuration({"max_vel_x": 0.2, "holonomic": False})
            return "set"
        except rospy.ROSException as e:
            rospy.logwarn("nobody to configure: %s", e)
            return "unset"


rospy.init_node("slow")
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("SLOW", Slow(), transitions={"set": "done", "unset": "done"})
sm.execute()
