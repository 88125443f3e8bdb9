#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Look(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["again", "tired"])
        self.n = 0

    def execute(self, ud):
        self.n += 1
        rospy.sleep(0.01)
        if self.n > 20:
            rospy.signal_shutdown("enough for a test")
        return "again"


rospy.init_node("for_ever")
sm = smach.StateMachine(outcomes=["preempted"])
with sm:
    smach.StateMachine.add("LOOK", Look(), {"again": "REST", "tired": "preempted"})
    smach.StateMachine.add(
        "REST", smach.CBState(lambda ud: "rested", outcomes=["rested"]), {"rested": "LOOK"}
    )
sm.execute()
