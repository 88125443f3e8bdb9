"""Runs of a mission that fails if it drives too slowly."""

from __future__ import annotations

from actionlib_core.clock import VirtualClock, use_clock
from smachpy import CBState, State, StateMachine
from smachpy.events import to_record
from smachpy.events.introspection import describe
from smachpy.events.recording import Recorder


class Drive(State):
    def __init__(self):
        super().__init__(["succeeded", "aborted", "preempted"], input_keys=["speed", "place"])

    def execute(self, userdata):
        if self.sleep(5.0 / userdata.speed):
            return "preempted"
        return "succeeded" if userdata.speed > 0.4 else "aborted"


def job(speed, place="dock"):
    def plan(userdata):
        userdata.speed, userdata.place = speed, place
        return "done"

    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="JOB")
    with sm:
        keys = ["speed", "place"]
        sm.add("PLAN", CBState(plan, outcomes=["done"], output_keys=keys), {"done": "DRIVE"})
        sm.add("DRIVE", Drive())
    return sm


def run(speed, place="dock", path=None):
    sm, story = job(speed, place), []
    sm.subscribe(lambda event: story.append(to_record(event)))
    with use_clock(VirtualClock()):
        if path is None:
            sm.execute()
        else:
            with Recorder(path, sm):
                sm.execute()
    return describe(sm), story


GOOD = [0.5, 0.52, 0.56, 0.6]
