#!/usr/bin/env python
# Subscribers with arguments, that leave in their callback; time-outs caught; rates and remaining time.
import rospy
import smach
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, Int32


class Watch(smach.State):
    def __init__(self, topic):
        smach.State.__init__(self, outcomes=["high", "low"])
        self.topic = topic
        self.value = None

    def cb(self, msg, args):
        factor, name = args
        self.value = msg.data * factor
        rospy.loginfo_throttle(1.0, "%s %s" % (name, self.value))
        self.sub.unregister()

    def execute(self, userdata):
        self.value = None
        self.sub = rospy.Subscriber(self.topic, Int32, self.cb, callback_args=(2, "twice"), queue_size=1)
        rate = rospy.Rate(10)
        while self.value is None and not rospy.is_shutdown():
            assert rate.remaining() <= rospy.Duration(0.1)
            rate.sleep()
        return "high" if self.value > 6 else "low"


class Scan(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])

    def execute(self, userdata):
        scan = None
        tries = 0
        while scan is None and tries < 3:
            tries += 1
            try:
                scan = rospy.wait_for_message("/base_scan_nobody", LaserScan, timeout=0.5)
            except rospy.ROSException as e:
                rospy.logwarn_once("no scan: %s" % type(e).__name__)
            except:
                raise
        return "done"


def main():
    rospy.init_node("watcher", disable_signals=True)
    pub = rospy.Publisher("numbers", Int32, queue_size=10, tcp_nodelay=True)
    count = [0]

    def publish(event):
        count[0] += 1
        pub.publish(count[0])
        if event.last_duration and event.last_duration > 1:
            rospy.logerr("slow")

    rospy.Timer(rospy.Duration(0.25), publish, oneshot=False)
    while pub.get_num_connections() < 0:
        rospy.sleep(0.1)
    sm = smach.StateMachine(outcomes=["finished"])
    with sm:
        smach.StateMachine.add("WATCH", Watch("numbers"), {"low": "WATCH", "high": "SCAN"})
        smach.StateMachine.add("SCAN", Scan(), {"done": "finished"})
    sm.execute()
    rospy.signal_shutdown("finished")


if __name__ == "__main__":
    main()
