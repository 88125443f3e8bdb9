#!/usr/bin/env python
import rospy, smach
import random
from std_msgs.msg import String, Int32

battery = 100
position = None
pub = None


def battery_cb(msg):
    global battery
    battery = msg.data


class Patrol(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["low", "go_on"])

    def execute(self, userdata):
        global battery
        pub.publish(Int32(battery - 30))
        rospy.sleep(1)
        rospy.loginfo("battery: %d", battery)
        return "low" if battery < 30 else "go_on"


class Dock(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["charged"])

    def execute(self, userdata):
        global battery
        battery = 100
        return "charged"


if __name__ == "__main__":
    rospy.init_node("blackboard")
    pub = rospy.Publisher("/battery", Int32, queue_size=10)
    rospy.Subscriber("/battery", Int32, battery_cb)
    sm = smach.StateMachine(outcomes=["finished"])
    with sm:
        smach.StateMachine.add("PATROL", Patrol(), {"low": "DOCK", "go_on": "PATROL"})
        smach.StateMachine.add("DOCK", Dock(), {"charged": "finished"})
    assert sm.execute() == "finished"
