#!/usr/bin/env python
import rospy, smach
import sys
import argparse

parser = argparse.ArgumentParser()
parser.add_argument("--laps", type=int, default=2)
args = parser.parse_args(rospy.myargv(argv=sys.argv)[1:])


class Lap(smach.State):
    def __init__(self, n):
        smach.State.__init__(self, outcomes=["more", "over"])
        self.n = n

    def execute(self, ud):
        self.n -= 1
        return "more" if self.n > 0 else "over"


rospy.init_node("laps", anonymous=True)
assert rospy.get_name().startswith("/laps_")
assert rospy.resolve_name("x") == "/x" and rospy.get_namespace() == "/"
sm = smach.StateMachine(outcomes=["over"])
with sm:
    smach.StateMachine.add("LAP", Lap(args.laps), {"more": "LAP"})
sm.execute()
