"""Guided recovery: when the robot cannot get there, try what usually helps, then ask a person.

    GUIDED_RECOVERY
      REMEMBER       where the robot stands now
      DRIVE          to the goal
      CHOOSE         what has not been tried since the last good word: CLEAR, ROTATE, then ASK
      CLEAR          forget obstacles that may have gone (the service), and drive again
      ROTATE         look all around, and drive again
      ASK            retry, home or give_up; when nobody answers: home
      COME_BACK      to where it stood

Run it: `smachpy run guided_recovery --start-robot`, and open the door when it asks
"""

from __future__ import annotations

from actionlib_core.interfaces.std_srvs.srv import Empty
from missions.ask_operator import AskOperator
from missions.maps import OFFICE_DOORS
from missions.move_base.geometry import Pose2D
from missions.parts import drive_back, drive_to, locate, turn
from smachpy import CBState, ServiceState, StateMachine, UserData

MEASURES = ("clear", "rotate", "ask")  # in this order
CALL_TIMEOUT = 5.0  # [s]


def guided_recovery(
    x: float = 17.9, y: float = 5.4, yaw: float = -1.5708, patience: float = 120.0
) -> StateMachine:
    """Drive to a place; clear the costmap, look around, ask a person when there is no way.

    Args:
        x: Of the goal [m], map frame.
        y: Of the goal [m], map frame.
        yaw: Of the goal [rad].
        patience: How long to wait for the person [s].
    """
    sm = StateMachine(["succeeded", "returned", "aborted", "preempted"], name="GUIDED_RECOVERY")
    sm.register_start_cb(lambda userdata, _initial: userdata.update({"tried": 0}))
    with sm:
        sm.add("REMEMBER", locate(), {"valid": "DRIVE", "invalid": "aborted"})
        sm.add("DRIVE", drive_to(Pose2D(x, y, yaw)), {"aborted": "CHOOSE"})
        sm.add(
            "CHOOSE",
            CBState(choose, outcomes=MEASURES, input_keys=["tried"], output_keys=["tried"]),
            {"clear": "CLEAR", "rotate": "ROTATE", "ask": "ASK"},
        )
        sm.add("CLEAR", clear(), {"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add("ROTATE", rotate(), {"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add(
            "ASK",
            AskOperator(
                f"I find no way to ({x:.1f}, {y:.1f}). What shall I do?",
                answers=("retry", "home", "give_up"),
                patience=patience,
            ),
            {"retry": "CLEAR", "home": "COME_BACK", "no_answer": "COME_BACK", "give_up": "aborted"},
        )
        sm.add("COME_BACK", drive_back(), {"succeeded": "returned"}, {"home": "here"})
    return sm


guided_recovery.world = OFFICE_DOORS  # type: ignore[attr-defined]  # where --start-robot plays it


def choose(userdata: UserData) -> str:
    """Name the next thing to try; after a person was asked, all of them may help again."""
    measure = MEASURES[userdata.tried]
    userdata.tried = (userdata.tried + 1) % len(MEASURES)
    return measure


def clear() -> ServiceState:
    """Let the robot forget the obstacles that it cannot see now."""
    return ServiceState("move_base/clear_costmaps", Empty, timeout=CALL_TIMEOUT)


def rotate() -> StateMachine:
    """Look all around: two half turns."""
    sm = StateMachine(["succeeded", "aborted", "preempted"])
    with sm:
        sm.add("HALF", turn(180.0), {"succeeded": "OTHER_HALF"})
        sm.add("OTHER_HALF", turn(180.0))
    return sm
