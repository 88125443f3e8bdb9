#!/usr/bin/env python3
# Functions that add states to whatever container is open, each state a class of its own inside.
import smach
import rospy
from smach import State, StateMachine


def split(name, to, input_key, output_keys):
    class Split(State):
        def __init__(self):
            State.__init__(
                self, outcomes=["succeeded"], input_keys=[input_key], output_keys=output_keys
            )
            self.input_key = input_key
            self.output_keys = output_keys

        def execute(self, userdata):
            for key in self.output_keys:
                userdata[key] = userdata[self.input_key][key]
            return "succeeded"

    StateMachine.add(name, Split(), transitions={"succeeded": to})


def repeat(name, state, count, on_success, on_failure):
    class Count(State):
        def __init__(self):
            State.__init__(self, outcomes=["again", "enough"])
            self.left = count

        def execute(self, userdata):
            self.left -= 1
            return "again" if self.left >= 0 else "enough"

    StateMachine.add(name + " count", Count(), {"again": name, "enough": on_failure})
    StateMachine.add(name, state, {"succeeded": on_success, "aborted": name + " count"})


class Grasp(State):
    def __init__(self, good_after):
        State.__init__(self, outcomes=["succeeded", "aborted"], input_keys=["x", "y"])
        self.tries = 0
        self.good_after = good_after

    def execute(self, ud):
        self.tries += 1
        rospy.loginfo("grasp %s at %s, %s", self.tries, ud.x, ud.y)
        return "succeeded" if self.tries > self.good_after else "aborted"


if __name__ == "__main__":
    rospy.init_node("splitter", anonymous=True)
    sm = StateMachine(["done", "failed"], input_keys=["target"])
    sm.userdata.target = dict(x=1.0, y=2.0, label="mug")
    with sm:
        split("UNPACK", "GRASP", "target", ["x", "y", "label"])
        repeat("GRASP", Grasp(2), 5, "done", "failed")
    sm.set_initial_state(["UNPACK"])
    outcome = sm.execute()
    rospy.loginfo("label %s: %s", sm.userdata.label, outcome)
