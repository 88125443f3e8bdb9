#!/usr/bin/env python
# strings where lists belong, callbacks with wrong arguments that are never called
import rospy, smach


class A(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"], input_keys="value")

    def execute(self, ud):
        return "ok"


rospy.init_node("strings")
sm = smach.StateMachine(outcomes=["ok"])
sm.userdata.value = 1
sm.register_start_cb(lambda: None)
with sm:
    smach.StateMachine.add("A", A(), transitions={"ok": "None"})
assert sm.execute() == "ok"
