#!/usr/bin/env python
# An action server with goal and preempt callbacks, and a state with callbacks for goal and result.
import actionlib
import rospy
import smach
import smach_ros
from actionlib_msgs.msg import GoalStatus
from move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult


class Counter(object):
    _feedback = MoveBaseFeedback()
    _result = MoveBaseResult()

    def __init__(self, name):
        self._action_name = name
        self._as = actionlib.SimpleActionServer(self._action_name, MoveBaseAction, auto_start=False)
        self._as.register_goal_callback(self.on_goal)
        self._as.register_preempt_callback(self.on_preempt)
        self.left = None
        self._as.start()
        rospy.Timer(rospy.Duration(0.1), self.step)

    def on_goal(self):
        self.left = int(self._as.accept_new_goal().target_pose.pose.position.x)

    def on_preempt(self):
        self.left = None
        self._as.set_preempted(self._result, "asked to stop")

    def step(self, event):
        if not self._as.is_active() or self.left is None:
            return
        self._feedback.base_position.pose.position.x = self.left
        self._as.publish_feedback(self._feedback)
        self.left -= 1
        if self.left <= 0:
            self._as.set_succeeded(self._result, "counted")


def goal_cb(userdata, goal):
    goal.target_pose.header.stamp = rospy.Time.now()
    goal.target_pose.pose.position.x = userdata.count
    return goal


@smach.cb_interface(output_keys=["status"], outcomes=["counted"])
def result_cb(userdata, status, result):
    userdata.status = status
    if status == GoalStatus.SUCCEEDED:
        return "counted"


def main():
    rospy.init_node("counts")
    Counter("count")
    sm = smach.StateMachine(["succeeded", "aborted", "preempted"])
    sm.userdata.count = 5
    with sm:
        smach.StateMachine.add(
            "COUNT",
            smach_ros.SimpleActionState(
                "count",
                MoveBaseAction,
                goal=MoveBaseGoal(),
                goal_cb=goal_cb,
                input_keys=["count"],
                result_cb=result_cb,
                output_keys=["status"],
                server_wait_timeout=rospy.Duration(10.0),
            ),
            transitions={"counted": "TOO_LONG", "succeeded": "aborted"},
        )
        smach.StateMachine.add(
            "TOO_LONG",
            smach_ros.SimpleActionState(
                "count",
                MoveBaseAction,
                goal_cb=lambda ud, default: goal_cb(type("Count", (), {"count": 500}), default),
                exec_timeout=rospy.Duration(1.0),
                preempt_timeout=rospy.Duration(2.0),
            ),
            transitions={"aborted": "succeeded", "preempted": "succeeded"},
        )
    sm.execute()
    rospy.loginfo("status %s", sm.userdata.status)


if __name__ == "__main__":
    main()
