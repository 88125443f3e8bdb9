#!/usr/bin/env python
# Every machine writes its parent's name into its labels.
import rospy
import smach
import smach_ros
from std_msgs.msg import Bool


class Walk(smach.State):
    def __init__(self, parent, steps):
        smach.State.__init__(self, outcomes=["succeeded", "preempted"])
        self.parent = parent
        self.steps = steps

    def execute(self, userdata):
        rospy.loginfo("%s walks %d steps", self.parent, self.steps)
        for _ in range(self.steps):
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            rospy.sleep(0.5)
        return "succeeded"


class SafeRoute(object):
    def __init__(self, parent, steps):
        self.parent = parent
        self.steps = steps
        self.near = False

    def on_distance(self, userdata, msg):
        return msg.data

    def any_ended(self, outcome_map):
        return True

    def build(self):
        walking = smach.Concurrence(
            outcomes=["near", "succeeded", "preempted"],
            default_outcome="preempted",
            outcome_map={
                "near": {self.parent + "/WATCH": "invalid"},
                "succeeded": {self.parent + "/WALK": "succeeded"},
            },
            child_termination_cb=self.any_ended,
        )
        with walking:
            smach.Concurrence.add(self.parent + "/WALK", Walk(self.parent, self.steps))
            smach.Concurrence.add(
                self.parent + "/WATCH",
                smach_ros.MonitorState("distance_ok", Bool, self.on_distance),
            )
        machine = smach.StateMachine(outcomes=["succeeded", "preempted"])
        with machine:
            smach.StateMachine.add(
                self.parent + "/SAFE_WALK", walking, transitions={"near": self.parent + "/WAIT"}
            )
            smach.StateMachine.add(
                self.parent + "/WAIT",
                Walk(self.parent + " waiting", 1),
                transitions={"succeeded": self.parent + "/SAFE_WALK"},
            )
        return machine


def main():
    rospy.init_node("row_follower")
    publisher = rospy.Publisher("distance_ok", Bool, queue_size=1, latch=True)
    publisher.publish(True)
    top = smach.StateMachine(outcomes=["succeeded", "preempted"])
    with top:
        smach.StateMachine.add("ROW_1", SafeRoute("ROW_1", 3).build(), {"succeeded": "ROW_2"})
        smach.StateMachine.add("ROW_2", SafeRoute("ROW_2", 2).build())
    rospy.Timer(rospy.Duration(0.7), lambda event: publisher.publish(False), oneshot=True)
    rospy.Timer(rospy.Duration(1.2), lambda event: publisher.publish(True), oneshot=True)
    print(top.execute())


if __name__ == "__main__":
    main()
