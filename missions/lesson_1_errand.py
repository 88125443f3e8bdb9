"""Lesson 1, a state machine: drive to a place, stop after a few seconds, drive back.

    THERE_AND_BACK
      REMEMBER   stores the robot's pose in the userdata key `home`
      GO         drives to the goal; stops after `seconds`
      COME_BACK  drives to `home`

Run it: `smachpy run there_and_back --start-robot`
"""

from __future__ import annotations

import math

from smachpy import StateMachine
from smachpy.states import MissionError, Pose2D, drive_to, locate


def there_and_back(
    x: float = 16.5, y: float = 10.4, yaw: float = 0.0, seconds: float = 3.0
) -> StateMachine:
    """Drive towards (x, y), stop after a few seconds, drive back.

    Args:
        x: The goal's x [m], map frame.
        y: The goal's y [m], map frame.
        yaw: The goal's heading [rad].
        seconds: How long the robot may drive.

    Raises:
        MissionError: `seconds` is not a positive, finite duration.
    """
    if not 0.0 < seconds < math.inf:
        raise MissionError(f"seconds: got {seconds:g}; expected more than 0.")
    # The timeout is what this mission wants, so it is an outcome of its own and no failure.
    go = drive_to(Pose2D(x, y, yaw), timeout=seconds, timeout_outcome="stopped")
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="THERE_AND_BACK")
    with sm:
        sm.add("REMEMBER", locate("home"), {"valid": "GO", "invalid": "aborted"})
        sm.add("GO", go, {"succeeded": "COME_BACK", "stopped": "COME_BACK"})
        sm.add("COME_BACK", drive_to("home"))  # without transitions: its outcomes are the machine's
    return sm
