#!/usr/bin/env python
# Userdata made by hand, filled by name, handed to execute() and read back from a sub-machine.
import copy

import rospy
import smach


class SetUserData(smach.State):
    def __init__(self, ud):
        smach.State.__init__(self, ["succeeded"], output_keys=ud.keys())
        self.ud = ud

    def execute(self, userdata):
        for key in self.ud.keys():
            userdata[key] = self.ud[key]
        return "succeeded"


class Sum(smach.State):
    def __init__(self):
        smach.State.__init__(
            self, ["done"], input_keys=["depth", "yaw", "history"], output_keys=["history", "total"]
        )

    def execute(self, userdata):
        if "depth" in userdata and "nothing" not in userdata:
            history = copy.copy(userdata.history)
            history.append((userdata["depth"], userdata.yaw))
            userdata.history = history
        userdata.total = userdata.depth + userdata.yaw
        return "done"


rospy.init_node("initialize", log_level=rospy.INFO)
initial = smach.UserData()
initial["yaw"] = 0.5
initial.depth = 2.0

sub = smach.StateMachine(["done"], input_keys=["history"], output_keys=["history", "total"])
with sub:
    smach.StateMachine.add("Set User Data", SetUserData(initial), {"succeeded": "Sum"})
    smach.StateMachine.add("Sum", Sum(), {"done": "done"})

sm = smach.StateMachine(["done"])
sm.userdata["history"] = []
sm.userdata.rounds = 0
with sm:
    smach.StateMachine.add("SUB", sub, {"done": "REPORT"}, remapping={"total": "sub_total"})

    @smach.cb_interface(input_keys=["sub_total", "history"], outcomes=["done"])
    def report(ud):
        rospy.loginfo("total %.1f of %r", ud.sub_total, ud.history)
        return "done"

    smach.StateMachine.add("REPORT", smach.CBState(report), {"done": "done"})

outcome = sm.execute(smach.UserData())
print(outcome, sm.userdata.sub_total, sorted(sm.userdata.keys()))
