"""Lesson 10, ask a person: what to do if the robot finds no way.

    ASKING
      DRIVE       drives to the goal
      ASK         answers: retry or home; without an answer in time: home
      COME_BACK   drives to where the robot lives

Run it: `smachpy run asking --start-robot`. The door is shut: open it and answer
"""

import smachpy
from smachpy.places.maps import OFFICE_DOORS
from smachpy.states import AskOperator, Pose2D, drive_to

LAB, HOME = Pose2D(17.9, 5.4, -1.57), Pose2D(9.8, 7.1, 1.57)  # x, y [m], heading [rad]


@smachpy.mission(world=OFFICE_DOORS)
def asking(patience: float = 60.0) -> smachpy.StateMachine:
    """Drive to the lab; if there is no way, ask a person.

    Args:
        patience: How long to wait for an answer [s].
    """
    ask = AskOperator(
        question="I find no way to the lab. What shall I do?",
        answers={"retry": "Try again", "home": "Come home"},
        patience=patience,
        default="home",
    )
    outcomes = ["succeeded", "returned", "aborted", "preempted"]
    sm = smachpy.StateMachine(outcomes=outcomes, name="ASKING")
    with sm:
        sm.add("DRIVE", drive_to(LAB), transitions={"aborted": "ASK"})
        sm.add("ASK", ask, transitions={"retry": "DRIVE", "home": "COME_BACK"})
        sm.add("COME_BACK", drive_to(HOME), transitions={"succeeded": "returned"})
    return sm
