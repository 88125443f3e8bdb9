#!/usr/bin/env python
import rospy
from smach import *


class Put(State):
    def __init__(self, value):
        State.__init__(self, outcomes=["succeeded"], output_keys=["out"])
        self.value = value

    def execute(self, userdata):
        userdata.out = self.value
        return "succeeded"


class Sum(State):
    def __init__(self):
        State.__init__(self, outcomes=["succeeded"], input_keys=["a", "b"])

    def execute(self, userdata):
        assert userdata.a + userdata["b"] == 3
        return "succeeded"


rospy.init_node("remap")
sm = StateMachine(outcomes=["succeeded"])
with sm:
    cc = Concurrence(
        outcomes=["succeeded", "aborted"],
        default_outcome="aborted",
        output_keys=["l", "r"],
        outcome_map={"succeeded": {"LEFT": "succeeded", "RIGHT": "succeeded"}},
    )
    with cc:
        Concurrence.add("LEFT", Put(1), remapping={"out": "l"})
        Concurrence.add("RIGHT", Put(2), remapping={"out": "r"})
    StateMachine.add(
        "BOTH", cc, {"aborted": "BOTH", "succeeded": "SUM"}, remapping={"l": "left", "r": "right"}
    )
    StateMachine.add("SUM", Sum(), remapping={"a": "left", "b": "right"})
sm.execute()
