#!/usr/bin/env python
import rospy
import smach
import smach_ros
import threading
from std_msgs.msg import Empty, Bool


def monitor_cb(ud, msg):
    return False


class Talk(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])
        self.pub = rospy.Publisher("/sm_reset", Empty, queue_size=1, latch=True)

    def execute(self, ud):
        self.pub.publish()
        return "done"


def main():
    rospy.init_node("monitor_example")
    sm = smach.StateMachine(outcomes=["DONE"])
    with sm:
        smach.StateMachine.add("TALK", Talk(), transitions={"done": "FOO"})
        smach.StateMachine.add(
            "FOO",
            smach_ros.MonitorState("/sm_reset", Empty, monitor_cb),
            transitions={"invalid": "DONE", "valid": "FOO", "preempted": "DONE"},
        )
    sis = smach_ros.IntrospectionServer("smach_server", sm, "/SM_ROOT")
    sis.start()
    sm.execute()
    rospy.spin()
    sis.stop()


if __name__ == "__main__":
    main()
