#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Order(object):
    def __init__(self, what):
        self.what = what
        self.history = []


class Take(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["taken"], input_keys=["orders"], output_keys=["order"])

    def execute(self, userdata):
        userdata.order = Order(userdata.orders.pop())
        return "taken"


class Serve(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["next", "empty"], input_keys=["order", "orders"])

    def execute(self, userdata):
        userdata.order.history.append("served")
        rospy.loginfo("served %s", userdata.order.what)
        return "next" if len(userdata.orders) > 0 else "empty"


if __name__ == "__main__":
    rospy.init_node("orders")
    sm = smach.StateMachine(outcomes=["finished"])
    sm.userdata.orders = ["tea", "coffee"]
    with sm:
        smach.StateMachine.add("TAKE", Take(), {"taken": "SERVE"})
        smach.StateMachine.add("SERVE", Serve(), {"next": "TAKE", "empty": "finished"})
    assert sm.execute() == "finished"
    assert sm.userdata.orders == []
