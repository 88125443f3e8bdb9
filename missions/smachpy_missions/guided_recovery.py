"""Recovery: if the robot finds no way, try two measures, then ask a person.

    GUIDED_RECOVERY
      REMEMBER       stores the robot's pose
      DRIVE          drives to the goal
      CHOOSE         picks the next measure: CLEAR, ROTATE, then ASK
      CLEAR          clears obstacles that may be gone (a service), then DRIVE again
      ROTATE         looks all around, then DRIVE again
      ASK            answers: retry, home or give_up; without an answer: home
      COME_BACK      drives to the stored pose

Run it: `smachpy run guided_recovery --start-robot`, and open the door when it asks
"""

import smachpy
from actionlib_core.interfaces.std_srvs.srv import Empty
from smachpy.places.maps import OFFICE_DOORS
from smachpy.states import AskOperator, Pose2D, drive_back, drive_to, locate, turn

MEASURES = ("clear", "rotate", "ask")  # cheapest first: a person's time costs most


@smachpy.state(outcomes=MEASURES, io_keys=["tried"])
def choose(userdata: smachpy.UserData) -> str:
    """Return the next measure; after a person has been asked, start again with the first."""
    measure = MEASURES[userdata.tried]
    userdata.tried = (userdata.tried + 1) % len(MEASURES)
    return measure


@smachpy.mission(world=OFFICE_DOORS)
def guided_recovery(
    x: float = 17.9, y: float = 5.4, yaw: float = -1.5708, patience: float = 120.0
) -> smachpy.StateMachine:
    """Drive to a place; if there is no way, clear the costmap, look around, ask a person.

    Args:
        x: The goal's x [m], map frame.
        y: The goal's y [m], map frame.
        yaw: The goal's heading [rad].
        patience: How long to wait for an answer [s].
    """
    clear = smachpy.ServiceState("move_base/clear_costmaps", Empty, timeout=5.0)
    rotate = smachpy.Sequence(
        outcomes=["succeeded", "aborted", "preempted"], connector_outcome="succeeded"
    )
    with rotate:
        rotate.add("HALF", turn(180.0))
        rotate.add("OTHER_HALF", turn(180.0))
    ask = AskOperator(
        f"I find no way to ({x:.1f}, {y:.1f}). What shall I do?",
        answers=("retry", "home", "give_up"),
        patience=patience,
    )
    sm = smachpy.StateMachine(
        outcomes=["succeeded", "returned", "aborted", "preempted"],
        name="GUIDED_RECOVERY",
        userdata={"tried": 0},  # in every run
    )
    with sm:
        sm.add("REMEMBER", locate("home"), transitions={"valid": "DRIVE", "invalid": "aborted"})
        sm.add("DRIVE", drive_to(Pose2D(x, y, yaw)), transitions={"aborted": "CHOOSE"})
        sm.add("CHOOSE", choose, transitions={"clear": "CLEAR", "rotate": "ROTATE", "ask": "ASK"})
        sm.add("CLEAR", clear, transitions={"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add("ROTATE", rotate, transitions={"succeeded": "DRIVE", "aborted": "CHOOSE"})
        sm.add(
            "ASK",
            ask,
            transitions={
                "retry": "CLEAR",
                "home": "COME_BACK",
                "no_answer": "COME_BACK",
                "give_up": "aborted",
            },
        )
        sm.add("COME_BACK", drive_back(), transitions={"succeeded": "returned"})
    return sm
