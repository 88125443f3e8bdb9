#!/usr/bin/env python
PKG = "test_missions"
import roslib

roslib.load_manifest(PKG)
import rospy
import unittest
import smach


class TestMission(unittest.TestCase):
    def test_it(self):
        sm = smach.StateMachine(outcomes=["done"])
        with sm:
            smach.StateMachine.add("A", smach.CBState(lambda ud: "done", outcomes=["done"]))
        self.assertEqual(sm.execute(), "done")


if __name__ == "__main__":
    import rostest

    rospy.init_node("test_mission")
    rostest.rosrun(PKG, "test_mission", TestMission)
