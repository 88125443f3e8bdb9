#!/usr/bin/env python
import rospy
import smach


class Wait(smach.State):
    def __init__(self, seconds):
        smach.State.__init__(self, outcomes=["done", "preempted"])
        self.seconds = seconds

    def execute(self, ud):
        end = rospy.Time.now() + rospy.Duration(self.seconds)
        while rospy.Time.now() < end:
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            rospy.sleep(0.1)
        return "done"


def child_term_cb(outcome_map):
    if outcome_map["FAST"] == "done":
        return True
    return False


def out_cb(outcome_map):
    if outcome_map["SLOW"] == "preempted":
        return "first"
    return "both"


rospy.init_node("concurrence")
cc = smach.Concurrence(
    outcomes=["first", "both"],
    default_outcome="both",
    child_termination_cb=child_term_cb,
    outcome_cb=out_cb,
)
with cc:
    smach.Concurrence.add("FAST", Wait(1))
    smach.Concurrence.add("SLOW", Wait(100))
start = rospy.get_time()
assert cc.execute() == "first"
assert rospy.get_time() - start < 20
