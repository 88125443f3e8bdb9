#!/usr/bin/env python
import rospy
from smach import Iterator, StateMachine, State


class Visit(State):
    def __init__(self):
        State.__init__(
            self,
            outcomes=["succeeded", "aborted"],
            input_keys=["place", "visited"],
            output_keys=["visited"],
        )

    def execute(self, userdata):
        userdata.visited = userdata.visited + [userdata.place]
        return "succeeded"


rospy.init_node("visit")
sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
sm.userdata.visited = []
with sm:
    it = Iterator(
        outcomes=["succeeded", "aborted", "preempted"],
        input_keys=["visited"],
        output_keys=["visited"],
        it=["kitchen", "lab", "door"],
        it_label="place",
        exhausted_outcome="succeeded",
    )
    with it:
        Iterator.set_contained_state("VISIT", Visit(), loop_outcomes=["succeeded", "not_there"])
    StateMachine.add("ALL", it)
assert sm.execute() == "succeeded"
assert sm.userdata.visited == ["kitchen", "lab", "door"]
