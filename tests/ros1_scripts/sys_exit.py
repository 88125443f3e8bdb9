#!/usr/bin/env python
import rospy
import smach
import smach_ros

import sys


class Foo(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])

    def execute(self, ud):
        rospy.logfatal("logged")
        rospy.logerr_throttle_identical(5, "same")
        return "done"


def main():
    rospy.init_node("exits")
    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        smach.StateMachine.add("FOO", Foo(), transitions={})
    return 0 if sm.execute() == "done" else 1


if __name__ == "__main__":
    sys.exit(main())
