#!/usr/bin/env python
# States with their own request_preempt, machines preempted by hand, recall_preempt.
import threading

import rospy
import smach
import smach_ros


class Motor(smach.State):
    def __init__(self):
        smach.State.__init__(self, outcomes=["arrived", "preempted"])
        self.stop = threading.Event()
        self.asked = 0

    def request_preempt(self):
        smach.State.request_preempt(self)
        self.asked += 1
        self.stop.set()

    def service_preempt(self):
        rospy.loginfo("motor stops")
        super(Motor, self).service_preempt()

    def execute(self, userdata):
        self.stop.clear()
        if self.stop.wait(5.0):
            self.service_preempt()
            return "preempted"
        return "arrived"


class Supervisor(smach.StateMachine):
    def __init__(self):
        smach.StateMachine.__init__(self, outcomes=["arrived", "stopped"])
        self.motor = Motor()
        with self:
            smach.StateMachine.add("MOTOR", self.motor, {"preempted": "stopped"})

    def execute(self, parent_ud=smach.UserData()):
        rospy.loginfo("supervisor begins")
        outcome = smach.StateMachine.execute(self, parent_ud)
        rospy.loginfo("supervisor ends: %s, active %s", outcome, self.get_active_states())
        return outcome


def main():
    rospy.init_node("own_preempts")
    supervisor = Supervisor()
    top = smach.StateMachine(outcomes=["arrived", "stopped"])
    with top:
        smach.StateMachine.add("DRIVE", supervisor)
    smach_ros.set_preempt_handler(top)
    results = []
    worker = threading.Thread(target=lambda: results.append(top.execute()))
    worker.start()
    rospy.sleep(1.0)
    assert top.is_running() and top.get_active_states() == ["DRIVE"]
    top.request_preempt()
    worker.join()
    top.recall_preempt()
    worker = threading.Thread(target=lambda: results.append(top.execute()))
    worker.daemon = True
    worker.start()
    while worker.is_alive() and not rospy.is_shutdown():
        rospy.sleep(0.1)
    print(results, supervisor.motor.asked >= 1)


if __name__ == "__main__":
    main()
