"""Lesson 7, async states and typed userdata: drive back and forth, and add up the distance.

    SHUTTLE
      DRIVE   an `async` state: reads its goal's feedback; a preempt cancels the goal
      COUNT   counts the trips, and repeats DRIVE until there are enough

Run it: `smachpy run shuttle --start-robot`
"""

from dataclasses import dataclass

import smachpy
from actionlib_core import ActionClient, ActionlibError
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy import StateMachine
from smachpy.states import DRIVE_TIMEOUT, MissionError, Pose2D, goal_at, pose_of

DRIVEN = ["arrived", "failed", "preempted"]
STOPS = (Pose2D(11.5, 8.0, 0.0), Pose2D(4.6, 8.0, 3.1416))


@dataclass
class Shuttle:
    """The mission's userdata; each write is checked against these types.

    Attributes:
        trips: Number of finished trips.
        metres: Distance driven so far [m].
    """

    trips: int = 0
    metres: float = 0.0


# A missing server, an aborted goal and a timeout raise ActionlibError: here they are an outcome.
@smachpy.state(DRIVEN, ["trips"], io_keys=["metres"], on_exception={ActionlibError: "failed"})
async def drive(userdata: Shuttle) -> str:
    """Drive to the next stop; an exit from `async with` before the goal ends cancels it."""
    client = ActionClient("move_base", MoveBaseAction)
    before = None
    async with client.send(goal_at(STOPS[userdata.trips % 2]), timeout=DRIVE_TIMEOUT) as goal:
        async for feedback in goal.feedback():
            here = pose_of(feedback.base_position.pose)
            userdata.metres += here.distance(before or here)
            before = here
        await goal
    return "arrived"


def shuttle(trips: int = 2) -> StateMachine:
    """Drive back and forth between two places.

    Args:
        trips: The number of drives.
    """
    if trips < 1:
        raise MissionError(f"trips: got {trips}; expected 1 or more.")

    @smachpy.state(["again", "done"], io_keys=["trips"])
    def count(userdata: Shuttle) -> str:
        userdata.trips += 1
        return "again" if userdata.trips < trips else "done"

    sm = StateMachine(["succeeded", "failed", "preempted"], name="SHUTTLE", userdata_type=Shuttle)
    sm.register_start_cb(lambda userdata, _: userdata.update({"trips": 0, "metres": 0.0}))
    with sm:
        sm.add("DRIVE", drive, {"arrived": "COUNT"})
        sm.add("COUNT", count, {"again": "DRIVE", "done": "succeeded"})
    return sm
