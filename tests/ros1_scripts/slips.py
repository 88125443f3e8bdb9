#!/usr/bin/env python
# What SMACH let pass: see the names.
import rospy
import smach


class ReadsOnly(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"], input_keys=["seen"])

    def execute(self, ud):
        ud.seen.append(1)
        ud.undeclared = 2
        return "ok"


class NoInit(smach.State):
    def __init__(self):
        self.count = 0

    def execute(self, ud):
        return "ok"


class Duck(object):
    def execute(self, ud):
        return "ok"

    def get_registered_outcomes(self):
        return ["ok"]

    def get_registered_input_keys(self):
        return []

    def get_registered_output_keys(self):
        return []


rospy.init_node("slips")
sm = smach.StateMachine(outcomes=["done"])
sm.userdata.seen = []
with sm:
    smach.StateMachine.set_initial_state(sm, ["READS ONLY"], smach.UserData())
    smach.StateMachine.add("READS ONLY", ReadsOnly(), {"ok": "NO INIT"})
    smach.StateMachine.add("NO INIT", NoInit(), {"ok": "DUCK"})
    smach.StateMachine.add("DUCK", Duck(), {"ok": "done"})
assert sm.execute() == "done"
assert sm.userdata.seen == [1]
