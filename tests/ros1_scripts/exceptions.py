#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Careful(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"], input_keys=["there"])

    def execute(self, userdata):
        try:
            userdata.there
        except KeyError:
            rospy.loginfo("no value")
        try:
            userdata.nowhere
        except smach.InvalidUserCodeError:
            rospy.loginfo("not declared")
        return "ok"


class Raises(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"])

    def execute(self, userdata):
        raise RuntimeError("on purpose")


rospy.init_node("exceptions")
bad = smach.StateMachine(outcomes=["ok"])
with bad:
    smach.StateMachine.add("RAISES", Raises())
sm = smach.StateMachine(outcomes=["ok"])
with sm:
    smach.StateMachine.add("CAREFUL", Careful())
    try:
        smach.StateMachine.add("CAREFUL", Careful())
    except smach.InvalidStateError as e:
        rospy.loginfo("label is taken: %s", e)
try:
    bad.execute()
except smach.InvalidUserCodeError as e:
    rospy.loginfo("as expected: %s", e)
assert sm.execute() == "ok"
