"""Lesson 12, async states and typed userdata: drive there and back, and tell how far it still is.

    OUT, BACK   `async` states that read their goal's feedback; a preempt cancels the goal

Run it: `smachpy run shuttle --start-robot`
"""

from dataclasses import dataclass

import smachpy
from actionlib_core import ActionClient, ActionlibError
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy.states import Pose2D, goal_at, pose_of


@dataclass
class Trip:
    """The userdata: type checkers know it, and each write is checked."""

    left: float = 0.0  # [m] to the goal, as the crow flies


def drive(place: Pose2D) -> smachpy.State:
    """Return a state that drives to a place. A goal that fails is the outcome `failed`."""

    @smachpy.state(outcomes=["arrived"], io_keys=["left"], on_exception={ActionlibError: "failed"})
    async def to(userdata: Trip) -> str:
        client = ActionClient("move_base", MoveBaseAction)
        async with client.send(goal_at(place), timeout=600.0) as goal:  # leaving it cancels
            async for feedback in goal.feedback():
                userdata.left = place.distance(pose_of(feedback.base_position.pose))
            await goal
        return "arrived"

    return to


def shuttle() -> smachpy.StateMachine:
    """Drive to the kitchen and back."""
    ends = ["arrived", "failed", "preempted"]
    sm = smachpy.StateMachine(outcomes=ends, name="SHUTTLE", userdata_type=Trip)
    with sm:
        sm.add("OUT", drive(Pose2D(4.6, 8.0, 3.14)), transitions={"arrived": "BACK"})
        sm.add("BACK", drive(Pose2D(11.5, 8.0, 0.0)))
    return sm
