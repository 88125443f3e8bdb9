#!/usr/bin/env python
import rospy, smach
from std_msgs.msg import String
from rospy import AnyMsg


class Hear(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["heard", "silence"])

    def execute(self, ud):
        try:
            rospy.wait_for_message("/silence", String, timeout=0.5)
            return "silence"
        except rospy.ROSException:
            rospy.loginfo("nothing, as expected")
        msg = rospy.wait_for_message("//chatter", String, rospy.Duration(5))
        kind = rospy.wait_for_message("/chatter", AnyMsg, 5)._connection_header["type"]
        return "heard" if msg.data == "hello" and kind == "std_msgs/String" else "silence"


rospy.init_node("hear")
pub = rospy.Publisher(rospy.get_namespace() + "/chatter", String, latch=True)
pub.publish("hello")
sm = smach.StateMachine(outcomes=["heard", "silence"])
with sm:
    smach.StateMachine.add("HEAR", Hear())
assert sm.execute() == "heard"
