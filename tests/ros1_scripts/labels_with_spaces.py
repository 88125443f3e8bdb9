#!/usr/bin/env python
from smach import State, StateMachine
import rospy


class Step(State):
    def __init__(self, name):
        State.__init__(self, outcomes=["ok", "not ok"])
        self.name = name

    def execute(self, ud):
        rospy.loginfo_once("%s %s", self.name, "step")
        rospy.logwarn_throttle(10, "throttled")
        rospy.logdebug("never seen")
        return "ok"


rospy.init_node("labels-with spaces", log_level=rospy.INFO)
sm = StateMachine(["all done", "gave up"])
with sm:
    StateMachine.add("first step", Step("1"), {"ok": "second step", "not ok": "gave up"})
    StateMachine.add("second step", Step("2"), {"ok": "Schritt drei: öffnen", "not ok": "gave up"})
    StateMachine.add("Schritt drei: öffnen", Step("3"), {"ok": "all done", "not ok": "gave up"})
print(sm.execute())
