#!/usr/bin/env python
# A machine that adds its states to itself, served as an action in a thread of its own.
import threading

import actionlib
import rospy
import smach
import smach_ros
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal, MoveBaseResult


class Align(smach.State):
    def __init__(self):
        super(Align, self).__init__(
            outcomes=["succeeded", "aborted"], input_keys=["sm_input"], output_keys=["sm_output"]
        )
        self._tries = 0

    def execute(self, ud):
        self._tries += 1
        ud.sm_output = MoveBaseResult()
        if ud.sm_input.target_pose.header.frame_id != "map":
            return "aborted"
        return "succeeded"


class Dock(smach.StateMachine):
    def __init__(self):
        smach.StateMachine.__init__(
            self,
            outcomes=["docked", "failed"],
            input_keys=["sm_input"],
            output_keys=["sm_output"],
        )
        with self:
            self.add("ALIGN", Align(), transitions={"succeeded": "CONTACT", "aborted": "failed"})
            self.add(
                "CONTACT",
                smach.CBState(lambda ud: "succeeded", outcomes=["succeeded", "aborted"]),
                transitions={"succeeded": "docked", "aborted": "failed"},
            )


def main():
    rospy.init_node("docking_smach")
    sm = Dock()
    server = smach_ros.ActionServerWrapper(
        "dock",
        MoveBaseAction,
        wrapped_container=sm,
        succeeded_outcomes=["docked"],
        aborted_outcomes=["failed"],
        goal_key="sm_input",
        result_key="sm_output",
    )
    smach_thread = threading.Thread(target=server.run_server())
    smach_thread.start()
    smach_thread.join()

    client = actionlib.SimpleActionClient("dock", MoveBaseAction)
    client.wait_for_server(rospy.Duration.from_sec(5.0))
    for frame in ("odom", "map"):
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = frame
        goal.target_pose.header.stamp = rospy.Time.now()
        client.send_goal(goal)
        client.wait_for_result()
        rospy.loginfo("%s: %d %s", frame, client.get_state(), client.get_goal_status_text())


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass
