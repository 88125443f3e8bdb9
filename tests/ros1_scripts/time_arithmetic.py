#!/usr/bin/env python
from __future__ import division, print_function
import rospy, smach


class Times(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["right", "wrong"])

    def execute(self, ud):
        start = rospy.Time.now()
        rospy.sleep(rospy.Duration.from_sec(1.5))
        took = (rospy.Time.now() - start).to_sec()
        later = start + rospy.Duration(10)
        right = abs(took - 1.5) < 0.6 and later > start and (later - start) / 2 == rospy.Duration(5)
        right = right and rospy.Time(1, 500000000).to_sec() == 1.5 and rospy.Time().is_zero()
        right = (
            right
            and rospy.Time.from_sec(2.5).secs == 2
            and abs(rospy.get_rostime() - rospy.Time.now()).to_sec() < 1
        )
        return "right" if right else "wrong"


rospy.init_node("times")
sm = smach.StateMachine(outcomes=["right", "wrong"])
with sm:
    smach.StateMachine.add("TIMES", Times())
assert sm.execute() == "right"
