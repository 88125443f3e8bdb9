#!/usr/bin/env python
import rospy
from smach import StateMachine
from smach_ros import ConditionState

rospy.init_node("conditions")
begin = rospy.get_time()
sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"])
sm.userdata.ready = 5
with sm:
    StateMachine.add(
        "WAIT",
        ConditionState(
            cond_cb=lambda ud: rospy.get_time() - begin > 1,
            poll_rate=rospy.Duration(0.1),
            timeout=rospy.Duration(10),
            max_checks=-1,
        ),
        {"true": "KEY", "false": "aborted"},
    )
    StateMachine.add(
        "KEY",
        ConditionState(lambda ud: ud.ready == 5, input_keys=["ready"]),
        {"true": "succeeded", "false": "aborted"},
    )
assert sm.execute() == "succeeded"
