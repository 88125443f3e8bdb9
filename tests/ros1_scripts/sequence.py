#!/usr/bin/env python
import rospy
import smach
from smach import Sequence, CBState, cb_interface


@cb_interface(outcomes=["succeeded", "aborted"], input_keys=["x"], output_keys=["x"])
def add_one(ud, by):
    ud.x += by
    return "succeeded"


rospy.init_node("sequence")
sq = Sequence(outcomes=["succeeded", "aborted", "preempted"], connector_outcome="succeeded")
sq.userdata.x = 0
with sq:
    Sequence.add("ONE", CBState(add_one, cb_args=[1]))
    Sequence.add("TWO", CBState(add_one, cb_kwargs={"by": 2}))
    Sequence.add("THREE", CBState(add_one, [3]))
assert sq.execute() == "succeeded"
assert sq.userdata.x == 6
