"""Lesson 6, drive somewhere: towards a place, for a few seconds, and back.

    THERE_AND_BACK
      REMEMBER   stores the robot's pose in the userdata key `home`
      GO         drives to the goal; stops after `seconds`
      COME_BACK  drives to `home`

Run it: `smachpy run there_and_back --start-robot`
"""

import smachpy
from smachpy.states import Pose2D, drive_to, locate


def there_and_back(
    x: float = 16.5, y: float = 10.4, yaw: float = 0.0, seconds: float = 3.0
) -> smachpy.StateMachine:
    """Drive towards (x, y), stop after a few seconds, drive back.

    Args:
        x: The goal's x [m], map frame.
        y: The goal's y [m], map frame.
        yaw: The goal's heading [rad].
        seconds: How long the robot may drive.
    """
    go = drive_to(Pose2D(x, y, yaw), timeout=seconds, timeout_outcome="stopped")
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="THERE_AND_BACK")
    with sm:
        sm.add("REMEMBER", locate("home"), transitions={"valid": "GO", "invalid": "aborted"})
        sm.add("GO", go, transitions={"succeeded": "COME_BACK", "stopped": "COME_BACK"})
        sm.add("COME_BACK", drive_to("home"))
    return sm
