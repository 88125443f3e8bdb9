#!/usr/bin/env python
import rospy
import rosparam
import smach


class Configured(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["ok"])
        self.rate = rospy.get_param("~rate", 10)
        self.places = rospy.get_param("/places", {"lab": [1.0, 2.0]})

    def execute(self, ud):
        rospy.set_param("/found/lab", {"x": 1, "y": [1, 2]})
        assert rospy.has_param("//found//lab/x") and rospy.get_param("found")["lab"]["y"] == [1, 2]
        rospy.set_param("~mine", True)
        assert rospy.get_param("/configured/mine") is True
        assert rospy.search_param("found") == "/found"
        rospy.delete_param("/found")
        try:
            rospy.get_param("/found")
        except KeyError:
            rospy.loginfo("gone: %s" % rospy.get_param_names())
        rosparam.upload_params("/bulk", {"a": {"b": 1}})
        assert rospy.get_param("/bulk/a/b") == 1
        return "ok"


rospy.init_node("configured")
sm = smach.StateMachine(outcomes=["ok"])
with sm:
    smach.StateMachine.add("CONFIGURED", Configured())
sm.execute()
