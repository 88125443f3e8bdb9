#!/usr/bin/env python
# execute in a thread, spin in the main one, an introspection server that is never stopped
import rospy, smach, smach_ros
import threading


class Work(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["again", "enough"])
        self.n = 0

    def execute(self, ud):
        rospy.sleep(0.5)
        self.n += 1
        return "again" if self.n < 4 else "enough"


rospy.init_node("worker")
sm = smach.StateMachine(outcomes=["done"])
with sm:
    smach.StateMachine.add("WORK", Work(), transitions={"again": "WORK", "enough": "done"})
sis = smach_ros.IntrospectionServer("worker", sm, "/WORKER")
sis.start()
smach_thread = threading.Thread(target=sm.execute)
smach_thread.start()
rospy.spin()
smach_thread.join()
