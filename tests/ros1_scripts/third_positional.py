#!/usr/bin/env python
# transitions and remapping by position, None and '' as targets, set_initial_state
from smach import State, StateMachine, UserData
import rospy


class Count(State):
    def __init__(self):
        State.__init__(self, ["up", "top"], ["n"], ["n"])

    def execute(self, ud):
        ud["n"] = ud["n"] + 1
        return "top" if ud.n > 2 else "up"


rospy.init_node("count")
sm = StateMachine(["top", "up"], [], ["m"])
ud = UserData()
ud.m = 0
with sm:
    StateMachine.add("SKIPPED", Count(), {"up": "COUNT", "top": "COUNT"}, {"n": "m"})
    StateMachine.add("COUNT", Count(), {"up": "COUNT", "top": None}, {"n": "m"})
    sm.set_initial_state(["SKIPPED"], ud)
assert sm.execute() == "top"
assert sm.userdata.m == 3
