#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Step(smach.State):
    def __init__(self, outcome="succeeded"):
        smach.State.__init__(self, outcomes=["succeeded", "aborted", "preempted"])
        self.outcome = outcome

    def execute(self, ud):
        return self.outcome


def nested(depth):
    sm = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
    with sm:
        if depth == 0:
            smach.StateMachine.add("LEAF", Step())
        else:
            smach.StateMachine.add(
                "LEVEL_%d" % depth, nested(depth - 1), transitions={"succeeded": "AFTER"}
            )
            smach.StateMachine.add("AFTER", Step("aborted" if depth > 5 else "succeeded"))
    return sm


rospy.init_node("levels")
top = nested(3)
sis = smach_ros.IntrospectionServer("levels", top, "/LEVELS")
sis.start()
top.execute()
sis.stop()
