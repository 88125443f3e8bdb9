#!/usr/bin/env python
import rospy
import smach
from smach_ros import ServiceState
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerResponse, Empty


def handle(req):
    return SetBoolResponse(req.data, "was %s" % req.data)


def trigger(req):
    return TriggerResponse(success=True, message="pulled")


rospy.init_node("services")
s1 = rospy.Service("switch", SetBool, handle)
s2 = rospy.Service("trigger", Trigger, trigger)
s3 = rospy.Service("nothing", Empty, lambda req: [])


@smach.cb_interface(input_keys=["on"])
def request_cb(userdata, request):
    request = SetBoolRequest()
    request.data = userdata.on
    return request


@smach.cb_interface(output_keys=["text"], outcomes=["succeeded", "aborted"])
def response_cb(userdata, response):
    userdata.text = response.message
    return "succeeded" if response.success else "aborted"


sm = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
sm.userdata.on = True
with sm:
    smach.StateMachine.add(
        "PLAIN", ServiceState("switch", SetBool, request=True), {"succeeded": "FIXED"}
    )
    smach.StateMachine.add(
        "FIXED", ServiceState("switch", SetBool, request=SetBoolRequest(True)), {"succeeded": "CB"}
    )
    smach.StateMachine.add(
        "CB",
        ServiceState("switch", SetBool, request_cb=request_cb, response_cb=response_cb),
        {"succeeded": "SLOTS"},
    )
    smach.StateMachine.add(
        "SLOTS",
        ServiceState("trigger", Trigger, response_slots=["message"]),
        {"succeeded": "EMPTY"},
    )
    smach.StateMachine.add("EMPTY", ServiceState("nothing", Empty))
assert sm.execute() == "succeeded"
assert sm.userdata.text == "was True" and sm.userdata.message == "pulled"
