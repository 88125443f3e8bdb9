#!/usr/bin/env python
# a state that runs a machine of its own by hand, and a container subclass that does so too
import rospy
import smach


class Say(smach.State):
    def __init__(self, what):
        smach.State.__init__(self, outcomes=["succeeded", "aborted", "preempted"])
        self.what = what

    def execute(self, ud):
        rospy.loginfo(self.what)
        return "succeeded"


class Outer(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["succeeded", "aborted"])
        self.inner = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
        with self.inner:
            smach.StateMachine.add("SAY", Say("inside"))

    def execute(self, ud):
        return self.inner.execute()


class Bare(smach.StateMachine):
    def __init__(self):
        smach.StateMachine.__init__(self, outcomes=["succeeded", "aborted"])

    def execute(self, ud):
        return Say("bare").execute(ud)


rospy.init_node("by_hand")
sm = smach.StateMachine(outcomes=["succeeded", "aborted"])
with sm:
    smach.StateMachine.add("OUTER", Outer(), transitions={"succeeded": "BARE"})
    smach.StateMachine.add("BARE", Bare())
assert sm.execute() == "succeeded"
