"""Lesson 8, two things at once: drive, and watch the battery while driving.

    WATCHED_DRIVE
      BOTH            runs its children at the same time; the first to end preempts the other
        DRIVE
        BATTERY       ends with `invalid` when the battery is low

Run it: `smachpy run watched_drive --start-robot`
"""

import smachpy
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from smachpy.states import Pose2D, drive_to


def charged(_userdata: smachpy.UserData, message: BatteryState) -> bool:
    """Return whether the battery is good enough to drive on."""
    return message.percentage > 0.2


def watched_drive(x: float = 16.5, y: float = 10.4) -> smachpy.StateMachine:
    """Drive to (x, y) [m] on the map; stop if the battery gets low."""
    both = smachpy.Concurrence(
        outcomes=["arrived", "low", "aborted", "preempted"],
        default_outcome="aborted",
        outcome_map={
            "arrived": {"DRIVE": "succeeded"},
            "low": {"DRIVE": "preempted", "BATTERY": "invalid"},
        },
        child_termination_cb=lambda _outcomes: True,  # the first to end preempts the other
    )
    with both:
        both.add("DRIVE", drive_to(Pose2D(x, y, 0.0)))
        both.add("BATTERY", smachpy.MonitorState("battery", BatteryState, charged))
    outcomes = ["succeeded", "low", "aborted", "preempted"]
    sm = smachpy.StateMachine(outcomes=outcomes, name="WATCHED_DRIVE")
    with sm:
        sm.add("BOTH", both, transitions={"arrived": "succeeded"})
    return sm
