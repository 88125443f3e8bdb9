#!/usr/bin/env python
import rospy
import smach
import smach_ros


class Blink(smach.State):
    def __init__(self, robot):
        smach.State.__init__(self, outcomes=["done"])
        self.robot = robot

    def execute(self, ud):
        self.robot.blinks += 1
        return "done"


class BlinkTwice(smach.StateMachine):
    def __init__(self, robot):
        smach.StateMachine.__init__(self, outcomes=["done"])
        with self:
            self.add("ONCE", Blink(robot), transitions={"done": "TWICE"})
            self.add("TWICE", Blink(robot), transitions={"done": "done"})


class Robot(object):
    def __init__(self):
        self.blinks = 0


class Node:
    def __init__(self):
        rospy.init_node("blinker")
        self.robot = Robot()
        self.sm = smach.StateMachine(outcomes=["finished"])
        self.sm.userdata.robot = self.robot
        with self.sm:
            smach.StateMachine.add(
                "BLINK", BlinkTwice(self.robot), transitions={"done": "finished"}
            )

    def run(self):
        self.sm.execute()
        assert self.robot.blinks == 2


if __name__ == "__main__":
    Node().run()
