#!/usr/bin/env python
# Errors of SMACH that a script counts on: bad outcomes, missing keys, states that raise.
import rospy
import smach


class Broken(smach.State):
    def __init__(self, how):
        smach.State.__init__(self, outcomes=["ok"], input_keys=["number"])
        self.how = how

    def execute(self, userdata):
        if self.how == "raises":
            raise RuntimeError("motor off")
        if self.how == "key":
            return "ok" if userdata.nobody else "ok"
        return self.how


def run(how):
    sm = smach.StateMachine(outcomes=["done"])
    sm.userdata.number = 1
    with sm:
        smach.StateMachine.add("BROKEN", Broken(how), transitions={"ok": "done"})
    try:
        sm.execute()
    except smach.InvalidUserCodeError as error:
        rospy.loginfo("%s: user code", how)
    except (smach.InvalidTransitionError, smach.InvalidStateError) as error:
        rospy.loginfo("%s: transition", how)
    except Exception as error:
        rospy.loginfo("%s: %s", how, type(error).__name__)


def build_wrong():
    sm = smach.StateMachine(outcomes=["done"])
    with sm:
        smach.StateMachine.add("A", Broken("ok"), transitions={"ok": "done"})
        try:
            smach.StateMachine.add("A", Broken("ok"), transitions={"ok": "done"})
        except smach.InvalidStateError:
            rospy.loginfo("twice")
        try:
            smach.StateMachine.add("B", Broken("ok"), transitions={"nothing": "done"})
        except smach.InvalidTransitionError:
            rospy.loginfo("no such outcome")


rospy.init_node("errors")
for word in ("raises", "key", "outcome"):
    run(word)
build_wrong()

last = smach.StateMachine(outcomes=["fine"])
with last:
    smach.StateMachine.add("FINE", smach.CBState(lambda ud: "ok", outcomes=["ok"]), {"ok": "fine"})
last.execute()
