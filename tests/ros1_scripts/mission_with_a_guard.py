#!/usr/bin/env python
# A mission beside a monitor that ends it, in a loop that waits for a switch.
import rospy
import smach
import smach_ros
from std_msgs.msg import Bool

previous = False


def or_filter(value):
    global previous
    result = value or previous
    previous = value
    return result


def press(_event):
    press.count += 1
    switch.publish(Bool(press.count % 10 < 6))


press.count = 0
rospy.init_node("guarded")
switch = rospy.Publisher("mission", Bool, queue_size=1)
rospy.Timer(rospy.Duration(0.2), press)

work = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
with work:
    smach.StateMachine.add(
        "Wait",
        smach_ros.ConditionState(lambda ud: False, poll_rate=rospy.Duration(0.1), max_checks=-1),
        transitions={"true": "succeeded", "false": "aborted"},
    )

guarded = smach.Concurrence(
    outcomes=["succeeded", "aborted", "switched off"],
    default_outcome="aborted",
    child_termination_cb=lambda so: True,
    outcome_map={
        "switched off": {"Monitor Mission": "invalid"},
        "succeeded": {"Mission": "succeeded"},
    },
)
with guarded:
    guarded.add("Mission", work)
    guarded.add(
        "Monitor Mission",
        smach_ros.MonitorState("mission", Bool, lambda ud, msg: or_filter(msg.data)),
    )

sm = smach.StateMachine(["over", "aborted"])
with sm:
    smach.StateMachine.add_auto(
        "Mission Switch",
        smach_ros.MonitorState("/mission", Bool, lambda ud, msg: not msg.data),
        connector_outcomes=["invalid"],
        transitions={"valid": "aborted", "preempted": "aborted"},
    )
    smach.StateMachine.add(
        "Mission with Monitor",
        guarded,
        transitions={"succeeded": "over", "aborted": "aborted", "switched off": "over"},
    )

result = sm.execute()
rospy.loginfo("guarded: %s", result)
rospy.signal_shutdown("All done.")
