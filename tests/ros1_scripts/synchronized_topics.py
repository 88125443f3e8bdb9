#!/usr/bin/env python
# Two topics in step by message_filters, a cache, and a state that waits for a pair.
import threading

import message_filters
import rospy
import smach
from geometry_msgs.msg import PointStamped


class WaitForPair(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["got_one", "timed_out"], output_keys=["pair"])
        left = message_filters.Subscriber("left", PointStamped)
        right = message_filters.Subscriber("right", PointStamped, queue_size=5)
        self.sync = message_filters.ApproximateTimeSynchronizer([left, right], 10, slop=0.05)
        self.sync.registerCallback(self.on_pair, "extra")
        self.cache = message_filters.Cache(left, 20)
        self.event = threading.Event()
        self.pair = None

    def on_pair(self, left, right, extra):
        self.pair = left.point.x, right.point.x
        self.event.set()

    def execute(self, userdata):
        deadline = rospy.Time.now() + rospy.Duration(20)
        while not self.event.is_set() and rospy.Time.now() < deadline:
            rospy.sleep(0.05)
        if not self.event.is_set():
            return "timed_out"
        userdata.pair = self.pair
        rospy.loginfo("pair %s, newest %s", self.pair, self.cache.getLastestTime() is not None)
        return "got_one"


def main():
    rospy.init_node("pairs")
    publishers = [rospy.Publisher(name, PointStamped, queue_size=10) for name in ("left", "right")]

    def publish(event):
        for number, publisher in enumerate(publishers):
            message = PointStamped()
            message.header.stamp = event.current_real + rospy.Duration(0.01 * number)
            message.point.x = number
            publisher.publish(message)

    timer = rospy.Timer(rospy.Duration(0.1), publish)
    sm = smach.StateMachine(outcomes=["succeeded", "aborted"])
    with sm:
        smach.StateMachine.add(
            "PAIR", WaitForPair(), {"got_one": "succeeded", "timed_out": "aborted"}
        )
    sm.execute()
    timer.shutdown()


if __name__ == "__main__":
    main()
