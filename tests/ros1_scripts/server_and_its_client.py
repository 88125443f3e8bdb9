#!/usr/bin/env python
# An action server of the low-level kind, a machine as a server, and the client of both, in one file.
import actionlib
import rospy
import smach
import smach_ros
from actionlib.msg import TestAction, TestFeedback, TestGoal, TestResult
from actionlib_msgs.msg import GoalStatus


class Doubler(object):
    _feedback = TestFeedback()
    _result = TestResult()

    def __init__(self, name):
        self._name = name
        self._as = actionlib.SimpleActionServer(
            self._name, TestAction, execute_cb=self.execute_cb, auto_start=False
        )
        self._as.register_preempt_callback(self.preempt_cb)
        self._as.start()

    def preempt_cb(self):
        rospy.loginfo("%s: Preempted", self._name)

    def execute_cb(self, goal):
        r = rospy.Rate(10)
        for i in range(1, goal.goal + 1):
            if self._as.is_preempt_requested():
                self._as.set_preempted()
                return
            self._feedback.feedback = i
            self._as.publish_feedback(self._feedback)
            r.sleep()
        self._result.result = 2 * goal.goal
        self._as.set_succeeded(self._result)


class Store(smach.State):
    def __init__(self):
        smach.State.__init__(
            self,
            outcomes=["succeeded"],
            input_keys=["sm_goal", "doubled"],
            output_keys=["sm_result"],
        )

    def execute(self, userdata):
        result = TestResult()
        result.result = userdata.doubled + userdata.sm_goal.goal
        userdata.sm_result = result
        return "succeeded"


def goal_cb(userdata, default_goal):
    goal = TestGoal()
    goal.goal = userdata.sm_goal.goal
    return goal


def main():
    rospy.init_node("triple_server")
    doubler = Doubler(rospy.get_name() + "/double")
    sm = smach.StateMachine(
        outcomes=["succeeded", "aborted", "preempted"],
        input_keys=["sm_goal"],
        output_keys=["sm_result"],
    )
    with sm:
        smach.StateMachine.add(
            "DOUBLE",
            smach_ros.SimpleActionState(
                "~double",
                TestAction,
                goal_cb=goal_cb,
                input_keys=["sm_goal"],
                result_slots=["result"],
                exec_timeout=rospy.Duration(30.0),
                preempt_timeout=rospy.Duration(5.0),
                server_wait_timeout=rospy.Duration(10.0),
            ),
            transitions={"succeeded": "STORE"},
            remapping={"result": "doubled"},
        )
        smach.StateMachine.add("STORE", Store())
    server = smach_ros.ActionServerWrapper(
        "triple",
        TestAction,
        wrapped_container=sm,
        succeeded_outcomes=["succeeded"],
        aborted_outcomes=["aborted"],
        preempted_outcomes=["preempted"],
        goal_key="sm_goal",
        result_key="sm_result",
    )
    server.run_server()

    client = actionlib.SimpleActionClient("triple", TestAction)
    client.wait_for_server(rospy.Duration(10))
    client.send_goal(TestGoal(goal=50))
    rospy.sleep(1.0)
    client.cancel_goal()
    client.wait_for_result()
    assert client.get_state() == GoalStatus.PREEMPTED
    state = client.send_goal_and_wait(TestGoal(goal=5), rospy.Duration(60))
    assert state == GoalStatus.SUCCEEDED, GoalStatus.to_string(state)
    rospy.loginfo("triple of 5: %s", client.get_result().result)
    assert client.get_result() == TestResult(15)
    rospy.signal_shutdown("tested")


if __name__ == "__main__":
    main()
