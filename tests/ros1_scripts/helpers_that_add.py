#!/usr/bin/env python
# Functions that add states of local classes to the machine that is open, as many robot labs had.
import random

import rospy
from smach import State, StateMachine


def inject(name, key, value):
    class Inject(State):
        def __init__(self):
            State.__init__(self, outcomes=["succeeded"], output_keys=[key])

        def execute(self, ud):
            ud[key] = value
            return "succeeded"

    StateMachine.add_auto(name, Inject(), ["succeeded"])


def select_nth(name, source, number, target):
    class SelectNth(State):
        def __init__(self):
            State.__init__(
                self, outcomes=["succeeded", "aborted"], input_keys=[source], output_keys=[target]
            )

        def execute(self, ud):
            try:
                ud[target] = ud[source][number]
            except IndexError:
                return "aborted"
            return "succeeded"

    StateMachine.add_auto(name, SelectNth(), ["succeeded"], transitions={"aborted": "fail"})


def call(name, function, *params):
    class Call(State):
        def __init__(self):
            State.__init__(self, outcomes=["succeeded"])

        def execute(self, ud):
            function(*params)
            return "succeeded"

    StateMachine.add_auto(name, Call(), ["succeeded"])


class RepeatN(State):
    def __init__(self, n):
        State.__init__(self, outcomes=["repeat", "done"])
        self.n, self.counter = n, 0

    def execute(self, ud):
        self.counter += 1
        return "repeat" if self.counter < self.n else "done"


class GoByData(State):
    def __init__(self, key, targets):
        forward = set(targets)
        forward.add("aborted")
        State.__init__(self, outcomes=list(forward), input_keys=[key])
        self.key, self.targets = key, targets

    def execute(self, ud):
        target = ud[self.key]
        return target if target in self.targets else "aborted"


def build(places):
    sm = StateMachine(outcomes=["success", "fail"])
    with sm:
        inject("PLACES", "places", places)
        call("HELLO", rospy.loginfo, "places: %s", ", ".join(places))
        select_nth("FIRST", "places", 0, "place")
        StateMachine.add(
            "WHERE",
            GoByData("place", ["kitchen", "hall"]),
            transitions={"kitchen": "AGAIN", "hall": "AGAIN", "aborted": "fail"},
        )
        StateMachine.add("AGAIN", RepeatN(3), transitions={"repeat": "HELLO", "done": "success"})
    return sm


if __name__ == "__main__":
    rospy.init_node("tidy_up", anonymous=True)
    random.seed(1)
    names = ["kitchen", "hall"]
    random.shuffle(names)
    rospy.loginfo("outcome: " + build(names).execute())
