#!/usr/bin/env python
import rospy
import smach
from std_srvs.srv import *


class Call(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok", "failed"])
        rospy.wait_for_service("//switch")
        self.switch = rospy.ServiceProxy("//switch", SetBool)

    def execute(self, ud):
        try:
            answers = [
                self.switch(True),
                self.switch(data=False),
                self.switch.call(SetBoolRequest(True)),
            ]
        except rospy.ServiceException as e:
            rospy.logerr("Service call failed: %s" % e)
            return "failed"
        try:
            rospy.ServiceProxy("/broken", Trigger)()
            return "failed"
        except rospy.ServiceException as e:
            rospy.loginfo("as expected: %s", e)
        try:
            rospy.wait_for_service("/nobody", timeout=1.0)
            return "failed"
        except rospy.ROSException:
            pass
        try:
            rospy.ServiceProxy("/nobody", Trigger)()
            return "failed"
        except rospy.ServiceException:
            return "ok" if [a.success for a in answers] == [True, False, True] else "failed"


def broken(req):
    raise ValueError("broken on purpose")


if __name__ == "__main__":
    rospy.init_node("calls", anonymous=True)
    rospy.Service("/switch", SetBool, lambda req: (req.data, ""))
    rospy.Service("/broken", Trigger, broken)
    sm = smach.StateMachine(outcomes=["ok", "failed"])
    with sm:
        smach.StateMachine.add("CALL", Call(), {})
    sm.execute()
