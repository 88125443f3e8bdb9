#!/usr/bin/env python
# a second state of a label, one instance twice, rules with names that are not there
import rospy, smach


class A(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"])

    def execute(self, ud):
        return "ok"


rospy.init_node("dup")
cc = smach.Concurrence(
    outcomes=["done"],
    default_outcome="done",
    outcome_map={"done": {"TWO": "ok"}, "never": {"ONE": "ok", "TWO": "bad"}},
)
a = A()
with cc:
    smach.Concurrence.add("ONE", A())
    smach.Concurrence.add("ONE", a)
    smach.Concurrence.add("TWO", A())
assert cc.execute() == "done"
