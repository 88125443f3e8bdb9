#!/usr/bin/env python
import rospy
import smach

class Tabs(smach.State):
	def __init__(self):
		smach.State.__init__(self, outcomes=["a"])
	def execute(self, ud):
        	if True:
			print "tabs", 
                	return "a"

if __name__ == "__main__":
	rospy.init_node("tabs")
	sm = smach.StateMachine(outcomes=["a"])
	with sm:
		smach.StateMachine.add("TABS", Tabs())
	sm.execute()
