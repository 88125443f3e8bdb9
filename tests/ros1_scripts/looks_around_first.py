#!/usr/bin/env python
# Looks for topics, services, nodes and the master before it builds its machine.
import os

import rosgraph
import rosnode
import rospy
import rosservice
import rostopic
import smach
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse


class CheckArm(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["there", "missing"])

    def execute(self, userdata):
        if "/arm/query_state" not in rosservice.get_service_list():
            return "missing"
        rospy.loginfo("type %s", rosservice.get_service_type("/arm/query_state"))
        request, response = rosservice.call_service("/arm/query_state", [])
        rospy.loginfo("it says %r", response.message)
        message_class, topic, _ = rostopic.get_topic_class("/arm/state")
        rospy.loginfo("%s: %s", topic, message_class._type if message_class else None)
        return "there"


if not os.environ["ROS_MASTER_URI"] or not rosgraph.is_master_online():
    raise SystemExit("no master")
rospy.init_node("looks_around")
rospy.Service("/arm/query_state", Trigger, lambda req: TriggerResponse(True, "idle"))
publisher = rospy.Publisher("/arm/state", String, latch=True, queue_size=1)
publisher.publish("idle")
rospy.loginfo("nodes %d, ours there: %s", len(rosnode.get_node_names()), rosnode.rosnode_ping("/looks_around", max_count=1))

sm = smach.StateMachine(outcomes=["ready", "not_ready"])
with sm:
    smach.StateMachine.add("CHECK", CheckArm(), {"there": "ready", "missing": "WAIT"})
    smach.StateMachine.add(
        "WAIT", smach.CBState(lambda ud: rospy.sleep(1) or "ok", outcomes=["ok"]), {"ok": "CHECK"}
    )
sm.execute()
