#!/usr/bin/env python
import rospy
import smach
import smach_ros


def say(text):
    return smach.CBState(
        lambda ud: rospy.loginfo(text) or "succeeded", outcomes=["succeeded", "aborted"]
    )


rospy.init_node("auto")
sm = smach.StateMachine(outcomes=["succeeded", "aborted"])
with sm:
    smach.StateMachine.add_auto("ONE", say("one"), connector_outcomes=["succeeded"])
    smach.StateMachine.add_auto("TWO", say("two"), ["succeeded"], transitions={"aborted": "ONE"})
    smach.StateMachine.add("THREE", say("three"))
sm.execute()
