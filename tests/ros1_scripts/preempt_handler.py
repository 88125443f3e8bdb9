#!/usr/bin/env python
import rospy
import smach
from smach_ros import set_preempt_handler, IntrospectionServer


class Forever(smach.State):
    def __init__(self):
        smach.State.__init__(self, ["finished", "preempted"])

    def execute(self, userdata):
        r = rospy.Rate(10)
        for i in range(600):
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            r.sleep()
        return "finished"


def main():
    rospy.init_node("preemptable")
    sm = smach.StateMachine(["finished", "preempted"])
    with sm:
        smach.StateMachine.add("FOREVER", Forever())
    set_preempt_handler(sm)
    sm.execute()
    rospy.signal_shutdown("All done.")


if __name__ == "__main__":
    main()
