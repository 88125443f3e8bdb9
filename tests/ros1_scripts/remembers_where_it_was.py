#!/usr/bin/env python
# A patrol that is broken off and goes on where it was: a state sets the machine's initial state.
import rospy
import smach
import smach_ros
from std_msgs.msg import Empty

POINTS = [(1.0, 0.0), (2.0, 0.0), (2.0, 1.0)]


class GoTo(smach.State):
    def __init__(self, x, y):
        super(GoTo, self).__init__(outcomes=["succeeded", "preempted"])
        self.x, self.y = x, y

    def execute(self, userdata):
        end = rospy.Time.now() + rospy.Duration(2.0)
        while rospy.Time.now() < end and not rospy.is_shutdown():
            if self.preempt_requested():
                self.service_preempt()
                return "preempted"
            rospy.sleep(0.1)
        return "succeeded"


class Remember(smach.State):
    def __init__(self, machine, label):
        super(Remember, self).__init__(
            outcomes=["succeeded"], input_keys=["visited"], output_keys=["visited"]
        )
        self.machine, self.label = machine, label

    def execute(self, userdata):
        self.machine.set_initial_state([self.label])
        userdata.visited = userdata.visited + [self.label]
        return "succeeded"


def ended(outcome_map):
    return outcome_map["TOUCH"] == "touched" or outcome_map["PATROL"] == "finished"


def choose(outcome_map):
    return "touched" if outcome_map["TOUCH"] == "touched" else "finished"


def main():
    rospy.init_node("patrol_and_touch")
    patrol = smach.StateMachine(outcomes=["finished", "preempted"])
    patrol.userdata.visited = []
    with patrol:
        for i, (x, y) in enumerate(POINTS):
            following = "POINT_%d" % (i + 1)
            last = i + 1 == len(POINTS)
            patrol.add("POINT_%d" % i, GoTo(x, y), transitions={"succeeded": "NOTE_%d" % i})
            patrol.add(
                "NOTE_%d" % i,
                Remember(patrol, "POINT_0" if last else following),
                transitions={"succeeded": "finished" if last else following},
            )
    touch = smach.StateMachine(outcomes=["touched", "preempted"])
    with touch:
        touch.add(
            "CHECK",
            smach_ros.MonitorState("touch", Empty, lambda ud, msg: False),
            transitions={"valid": "CHECK", "invalid": "touched"},
        )
    both = smach.Concurrence(
        outcomes=["touched", "finished", "preempted"],
        default_outcome="finished",
        child_termination_cb=ended,
        outcome_cb=choose,
    )
    with both:
        both.add("PATROL", patrol)
        both.add("TOUCH", touch)
    top = smach.StateMachine(outcomes=["finished", "preempted"])
    with top:
        top.add("PATROL_AND_TOUCH", both, transitions={"touched": "PATROL_AND_TOUCH"})
    finger = rospy.Publisher("touch", Empty, queue_size=1)
    rospy.Timer(rospy.Duration(3.0), lambda event: finger.publish(), oneshot=True)
    print(top.execute(), patrol.userdata.visited)


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass
