#!/usr/bin/env python
# A machine watched from outside through its inner attributes, preempted by a thread.
import threading

import rospy
import smach


class Work(smach.State):
    def __init__(self, seconds):
        smach.State.__init__(self, outcomes=["succeeded", "preempted"])
        self.seconds = seconds

    def request_preempt(self):
        rospy.loginfo("asked to stop")
        smach.State.request_preempt(self)

    def execute(self, ud):
        end = rospy.get_time() + self.seconds
        while rospy.get_time() < end:
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            rospy.sleep(0.05)
        return "succeeded"


class Watcher(threading.Thread):
    def __init__(self, sm):
        threading.Thread.__init__(self)
        self.daemon = True
        self.sm = sm

    def run(self):
        seen = []
        while not rospy.is_shutdown() and len(seen) < 3:
            active = self.sm.get_active_states()
            if active and (not seen or seen[-1] != active[0]):
                seen.append(active[0])
                rospy.loginfo("%s %s %s", active[0], self.sm.is_running(), sorted(self.sm.get_children()))
            if active == ["LONG"]:
                break
            rospy.sleep(0.1)
        rospy.sleep(0.5)
        self.sm.request_preempt()


def main():
    rospy.init_node("watched")
    sm = smach.StateMachine(outcomes=["succeeded"])
    with sm:
        for name, after, seconds in (("SHORT", "LONG", 0.5), ("LONG", "succeeded", 60)):
            smach.StateMachine.add(
                name, Work(seconds), transitions={"succeeded": after, "preempted": "STOPPED"}
            )
        smach.StateMachine.add(
            "STOPPED",
            smach.CBState(lambda ud: "ok", outcomes=["ok"]),
            transitions={"ok": "succeeded"},
        )
    sm.set_initial_state(["SHORT"])
    watcher = Watcher(sm)
    watcher.start()
    outcome = sm.execute()
    watcher.join(5)
    rospy.loginfo("outcome %s; %s", outcome, sm.preempt_requested())
    labels, transitions = sorted(sm._states), sm._transitions["LONG"]
    work = sm["LONG"]
    assert work._outcomes == {"succeeded", "preempted"}
    assert work._input_keys == work._output_keys == set()
    rospy.loginfo("%s %s", labels, sorted(transitions.items()))


if __name__ == "__main__":
    main()
