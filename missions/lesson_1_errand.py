"""Lesson 1, a state machine: drive to a place, stop after some seconds, drive back.

    THERE_AND_BACK
      REMEMBER   where the robot stands now, in the userdata key `home`
      GO         to the goal; stopped after some seconds
      COME_BACK  to where it stood

Run it: `smachpy run there_and_back --start-robot`
"""

from __future__ import annotations

import math

from smachpy import StateMachine
from smachpy.states import MissionError, Pose2D, drive_to, locate


def there_and_back(
    x: float = 16.5, y: float = 10.4, yaw: float = 0.0, seconds: float = 3.0
) -> StateMachine:
    """Drive towards (x, y), stop after some seconds, drive back.

    Args:
        x: Of the goal [m], map frame.
        y: Of the goal [m], map frame.
        yaw: Of the goal [rad].
        seconds: How long it may drive.

    Raises:
        MissionError: `seconds` is not a duration.
    """
    if not 0.0 < seconds < math.inf:
        raise MissionError(f"seconds: got {seconds:g}; expected more than 0.")
    go = drive_to(Pose2D(x, y, yaw), timeout=seconds, timeout_outcome="stopped")
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="THERE_AND_BACK")
    with sm:
        sm.add("REMEMBER", locate("home"), {"valid": "GO", "invalid": "aborted"})
        sm.add("GO", go, {"succeeded": "COME_BACK", "stopped": "COME_BACK"})
        sm.add("COME_BACK", drive_to("home"))
    return sm
