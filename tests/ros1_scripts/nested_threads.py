#!/usr/bin/env python
# The node in the main program, the machine in a thread that starts another thread, and spin.
import threading
import time

import rospy
import smach
import smach_ros
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

current = Odometry()
count = 0


def on_odom(msg):
    global current, count
    current = msg
    count += 1


def wait(seconds):
    rate = rospy.Rate(20)
    start = time.time()
    while not rospy.is_shutdown() and time.time() - start < seconds:
        rate.sleep()


class Forward(smach.State):
    def __init__(self, speed):
        smach.State.__init__(self, outcomes=["succeeded", "failed"])
        self.pub = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        self.sub = rospy.Subscriber("/cmd_vel", Twist, self.echo)
        self.heard = None
        self.speed = speed

    def echo(self, msg):
        self.heard = msg.linear.x

    def execute(self, userdata):
        msg = Twist()
        msg.linear.x = self.speed
        for _ in range(5):
            self.pub.publish(msg)
            wait(0.2)
        self.pub.publish(Twist())
        wait(0.1)
        return "succeeded" if self.heard == 0 else "failed"


def machine():
    sm = smach.StateMachine(outcomes=["DONE", "FAILED"])
    with sm:
        smach.StateMachine.add(
            "FORWARD-1", Forward(0.3), transitions={"succeeded": "BACK-1", "failed": "FAILED"}
        )
        smach.StateMachine.add(
            "BACK-1", Forward(-0.3), transitions={"succeeded": "DONE", "failed": "FAILED"}
        )
    sis = smach_ros.IntrospectionServer("drive", sm, "/DRIVE")
    sis.start()
    smach_ros.set_preempt_handler(sm)
    runner = threading.Thread(target=sm.execute)
    runner.start()


if __name__ == "__main__":
    rospy.init_node("DRIVE")
    rospy.Subscriber("odom", Odometry, on_odom)
    starter = threading.Thread(target=machine)
    starter.start()
    rospy.spin()
