"""Lesson 3, ask a person: when the robot cannot get there, try what usually helps, then ask.

    GUIDED_RECOVERY
      REMEMBER       where the robot stands now
      DRIVE          to the goal
      CHOOSE         the next measure: CLEAR, ROTATE, then ASK
      CLEAR          forget obstacles that may have gone (a service), and drive again
      ROTATE         look all around, and drive again
      ASK            retry, home or give_up; when nobody answers: home
      COME_BACK      to where it stood

Run it: `smachpy run guided_recovery --start-robot`, and open the door when it asks
"""

import smachpy
from actionlib_core.interfaces.std_srvs.srv import Empty
from smachpy import Sequence, ServiceState, StateMachine, UserData
from smachpy.sim.maps import OFFICE_DOORS
from smachpy.states import AskOperator, Pose2D, drive_back, drive_to, locate, turn

MEASURES = ("clear", "rotate", "ask")  # in this order


@smachpy.state(MEASURES, io_keys=["tried"])
def choose(userdata: UserData) -> str:
    """Return the next measure; after a person was asked, all of them may help again."""
    measure = MEASURES[userdata.tried]
    userdata.tried = (userdata.tried + 1) % len(MEASURES)
    return measure


@smachpy.mission(world=OFFICE_DOORS)
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
    clear = ServiceState("move_base/clear_costmaps", Empty, timeout=5.0)
    rotate = Sequence(["succeeded", "aborted", "preempted"], connector_outcome="succeeded")
    rotate.add("HALF", turn(180.0))
    rotate.add("OTHER_HALF", turn(180.0))
    ask = AskOperator(
        f"I find no way to ({x:.1f}, {y:.1f}). What shall I do?",
        answers=("retry", "home", "give_up"),
        patience=patience,
    )
    answers = {"retry": "CLEAR", "home": "COME_BACK", "no_answer": "COME_BACK"}
    sm = StateMachine(["succeeded", "returned", "aborted", "preempted"], name="GUIDED_RECOVERY")
    sm.register_start_cb(lambda userdata, _: userdata.update({"tried": 0}))  # at each run
    with sm:
        sm.add("REMEMBER", locate("home"), {"valid": "DRIVE", "invalid": "aborted"})
        sm.add("DRIVE", drive_to(Pose2D(x, y, yaw)), {"aborted": "CHOOSE"})
        sm.add("CHOOSE", choose, {"clear": "CLEAR", "rotate": "ROTATE", "ask": "ASK"})
        sm.add("CLEAR", clear, {"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add("ROTATE", rotate, {"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add("ASK", ask, {**answers, "give_up": "aborted"})
        sm.add("COME_BACK", drive_back(), {"succeeded": "returned"})
    return sm
