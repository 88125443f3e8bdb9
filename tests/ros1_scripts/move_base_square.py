#!/usr/bin/env python
# Drives to two places; in a thread, with rospy.spin() in the main one.
import threading
import rospy
import smach
import smach_ros
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import Pose, Point, Quaternion
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal


class Patrol:
    def __init__(self):
        rospy.init_node("patrol_smach", anonymous=False)
        rospy.on_shutdown(self.shutdown)
        waypoints = [
            Pose(Point(10.0, 8.0, 0.0), Quaternion(0, 0, 0, 1)),
            Pose(Point(11.0, 8.0, 0.0), Quaternion(0, 0, 0, 1)),
        ]
        nav_states = []
        for pose in waypoints:
            nav_goal = MoveBaseGoal()
            nav_goal.target_pose.header.frame_id = "map"
            nav_goal.target_pose.header.stamp = rospy.Time.now()
            nav_goal.target_pose.pose = pose
            nav_states.append(
                smach_ros.SimpleActionState(
                    "move_base",
                    MoveBaseAction,
                    goal=nav_goal,
                    result_cb=self.move_base_result_cb,
                    exec_timeout=rospy.Duration(60.0),
                    server_wait_timeout=rospy.Duration(10.0),
                )
            )
        self.n_succeeded = 0
        self.sm_patrol = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
        with self.sm_patrol:
            smach.StateMachine.add(
                "NAV_STATE_0",
                nav_states[0],
                transitions={
                    "succeeded": "NAV_STATE_1",
                    "aborted": "NAV_STATE_1",
                    "preempted": "NAV_STATE_1",
                },
            )
            smach.StateMachine.add(
                "NAV_STATE_1",
                nav_states[1],
                transitions={"succeeded": "", "aborted": "", "preempted": ""},
            )
        intro_server = smach_ros.IntrospectionServer("patrol", self.sm_patrol, "/SM_ROOT")
        intro_server.start()
        thread = threading.Thread(target=self.run)
        thread.start()
        rospy.spin()
        thread.join()
        intro_server.stop()

    def run(self):
        outcome = self.sm_patrol.execute()
        rospy.loginfo("outcome %s", outcome)
        assert self.n_succeeded == 2
        rospy.signal_shutdown("patrol is over")

    def move_base_result_cb(self, userdata, status, result):
        if status == GoalStatus.SUCCEEDED:
            self.n_succeeded += 1

    def shutdown(self):
        rospy.loginfo("Stopping the robot...")
        self.sm_patrol.request_preempt()


if __name__ == "__main__":
    try:
        Patrol()
    except rospy.ROSInterruptException:
        rospy.loginfo("patrol test finished.")
