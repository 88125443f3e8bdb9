"""Services of ROS 1: serves each `NAME`, as SetBool or, if it clears something, Empty; each line of standard input `SERVICE BOOL` is a call,
`SERVICE persistent` two on one connection."""

import sys

import rospy
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse

rospy.init_node("ros_services")


def handle(request):
    if not request.data:
        raise ValueError("not that way")
    return SetBoolResponse(True, "by ROS 1")


def clear(_request):
    return EmptyResponse()


services = [
    rospy.Service(name, Empty, clear) if "clear" in name else rospy.Service(name, SetBool, handle)
    for name in sys.argv[1:]
]
print("ready", flush=True)
for line in sys.stdin:
    name, value = line.split()
    try:
        rospy.wait_for_service(name, 60)
        if value == "persistent":
            proxy = rospy.ServiceProxy(name, SetBool, persistent=True)
            first, second = proxy(True), proxy(True)
            print(first.success, first.message, second.success, second.message, flush=True)
            continue
        answer = rospy.ServiceProxy(name, SetBool)(value == "True")
        print(answer.success, answer.message, flush=True)
    except (rospy.ServiceException, rospy.ROSException) as error:
        print("error", error, flush=True)
