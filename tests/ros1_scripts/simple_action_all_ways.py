#!/usr/bin/env python
import rospy, smach, actionlib
from smach_ros import SimpleActionState
from actionlib.msg import TestAction, TestGoal, TestFeedback, TestResult


class Server(object):
    def __init__(self):
        self.server = actionlib.SimpleActionServer("count", TestAction, self.execute, False)
        self.server.start()

    def execute(self, goal):
        for i in range(goal.goal):
            if self.server.is_preempt_requested():
                self.server.set_preempted()
                return
            self.server.publish_feedback(TestFeedback(i))
            rospy.sleep(0.1)
        self.server.set_succeeded(TestResult(goal.goal), "counted")


def goal_cb(userdata, goal):
    goal.goal = userdata.n
    return goal


def result_cb(userdata, status, result):
    userdata.total = userdata.total + result.result
    return "many" if result.result > 2 else "succeeded"


rospy.init_node("count")
server = Server()
sm = smach.StateMachine(outcomes=["succeeded", "aborted", "preempted"])
sm.userdata.n, sm.userdata.total, sm.userdata.goal = 3, 0, 2
sm.userdata.whole = TestGoal(goal=1)
with sm:
    smach.StateMachine.add(
        "CB",
        SimpleActionState(
            "count",
            TestAction,
            goal_cb=goal_cb,
            result_cb=result_cb,
            outcomes=["many"],
            input_keys=["n", "total"],
            output_keys=["total"],
        ),
        transitions={"many": "SLOTS"},
    )
    smach.StateMachine.add(
        "SLOTS",
        SimpleActionState("count", TestAction, goal_slots=["goal"], result_slots=["result"]),
        {"succeeded": "KEY"},
    )
    smach.StateMachine.add(
        "KEY",
        SimpleActionState("count", TestAction, goal_key="whole", result_key="res"),
        {"succeeded": "LATE"},
    )
    smach.StateMachine.add(
        "LATE",
        SimpleActionState(
            "count", TestAction, goal=TestGoal(1000), exec_timeout=rospy.Duration(1.0)
        ),
        {"aborted": "succeeded", "preempted": "succeeded"},
    )
assert sm.execute() == "succeeded"
assert sm.userdata.total == 3 and sm.userdata.result == 2 and sm.userdata.res.result == 1
