#!/usr/bin/env python
# drives beside a watchdog; the watchdog ends first and preempts the drive
import rospy
from smach import Concurrence, State, StateMachine
from smach_ros import SimpleActionState
from move_base_msgs.msg import *


class Watchdog(State):
    def __init__(self):
        State.__init__(self, outcomes=["alarm", "preempted"])

    def execute(self, ud):
        for _ in range(10):
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            rospy.sleep(0.1)
        return "alarm"


rospy.init_node("guarded")
goal = MoveBaseGoal()
goal.target_pose.header.frame_id = "map"
goal.target_pose.pose.position.x = 14.0
goal.target_pose.pose.position.y = 8.0
goal.target_pose.pose.orientation.w = 1.0
sm = StateMachine(outcomes=["arrived", "stopped", "failed"])
with sm:
    cc = Concurrence(
        outcomes=["arrived", "stopped", "failed"],
        default_outcome="failed",
        child_termination_cb=lambda outcomes: True,
        outcome_map={
            "arrived": {"DRIVE": "succeeded"},
            "stopped": {"DRIVE": "preempted", "WATCH": "alarm"},
        },
    )
    with cc:
        Concurrence.add("DRIVE", SimpleActionState("move_base", MoveBaseAction, goal=goal))
        Concurrence.add("WATCH", Watchdog())
    StateMachine.add("GUARDED", cc)
assert sm.execute() == "stopped"
