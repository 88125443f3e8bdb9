#!/usr/bin/env python
import logging
import rospy
import smach
from rospy import loginfo, logwarn as warn


class Chatty(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["done"])

    def execute(self, ud):
        for i in range(5):
            rospy.loginfo_throttle(100, "once in 100 s: %d" % i)
            rospy.logerr_once("only once")
            rospy.logwarn_throttle_identical(100, "value %d", i // 3)
        rospy.logdebug("debug %s", 1)
        loginfo("tuple %s and %d", (1, 2), 3)
        warn("100% sure")
        rospy.loginfo({"a": 1})
        rospy.loginfo("wrong number of %s %s", "arguments")
        logging.getLogger("rosout").info("by logging")
        smach.loginfo("by smach")
        return "done"


rospy.init_node("chatty", log_level=rospy.DEBUG)
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("CHATTY", Chatty())
sm.execute()
