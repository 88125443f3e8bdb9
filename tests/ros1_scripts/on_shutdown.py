#!/usr/bin/env python
import rospy
import smach
import smach_ros

from geometry_msgs.msg import Twist

called = []


class Drive(smach.State):
    def __init__(self, pub):
        smach.State.__init__(self, outcomes=["done"])
        self.pub = pub

    def execute(self, userdata):
        t = Twist()
        t.linear.x = 0.2
        for _ in range(10):
            self.pub.publish(t)
            rospy.sleep(rospy.Duration(0, 100000000))
        return "done"


def stop():
    called.append(1)
    pub.publish(Twist())
    rospy.loginfo("stopped")


rospy.init_node("drive")
pub = rospy.Publisher("cmd_vel", Twist, queue_size=1)
rospy.on_shutdown(stop)
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("DRIVE", Drive(pub))
sm.execute()
rospy.signal_shutdown("finished")
assert called == [1] and rospy.is_shutdown()
