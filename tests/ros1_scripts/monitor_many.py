#!/usr/bin/env python
import rospy, smach
from smach_ros import MonitorState
from std_msgs.msg import Float32


def above(userdata, msg):
    userdata.seen.append(msg.data)
    return msg.data < 3


def talk(event):
    talk.n += 1
    talk.pub.publish(Float32(talk.n))


talk.n = 0
rospy.init_node("levels")
talk.pub = rospy.Publisher("level", Float32, queue_size=5)
timer = rospy.Timer(rospy.Duration(0.2), talk)
sm = smach.StateMachine(outcomes=["reached", "failed"])
sm.userdata.seen = []
with sm:
    smach.StateMachine.add(
        "WATCH",
        MonitorState(
            "level", Float32, above, max_checks=50, input_keys=["seen"], output_keys=["seen"]
        ),
        {"invalid": "reached", "valid": "failed", "preempted": "failed"},
    )
outcome = sm.execute()
timer.shutdown()
assert outcome == "reached", outcome
