"""Lesson 6, a machine as an action server: other programs send goals, the machine runs them.

    LOOK_AT_SERVER      runs for each goal of the action `look_at`
      DRIVE             drives to the goal's pose; a cancel preempts it
      TURN, TURN_BACK   turn by 360 degrees in total, to see everything

    LOOK_AT             the mission: starts the server and sends it one goal
      SEND

Run it: `smachpy run look_at --start-robot`. The server alone: `smachpy run look_at.server`
"""

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseFeedback
from smachpy import ActionServerWrapper, SimpleActionState, StateMachine, UserData
from smachpy.states import Pose2D, drive_to, goal_at, serve_during, serving_machine, turn

NAME = "look_at"
ENDS = ["succeeded", "aborted", "preempted"]


def tell_where(userdata: UserData, feedback: MoveBaseFeedback) -> None:
    """Forward the robot's pose to the client of `look_at`."""
    userdata.feedback = feedback


def go_and_look() -> StateMachine:
    """Drive to the pose in the userdata key `place` and look all around."""
    sm = StateMachine(ENDS, ["place", "feedback"], ["feedback"], name="LOOK_AT_SERVER")
    drive = drive_to("place", feedback_cb=tell_where, output_keys=["feedback"])
    with sm:
        sm.add("DRIVE", drive, {"succeeded": "TURN"})
        sm.add("TURN", turn(180.0), {"succeeded": "TURN_BACK"})
        sm.add("TURN_BACK", turn(180.0))
    return sm


def offer() -> ActionServerWrapper:
    """Offer the action `look_at` on the network."""
    server = ActionServerWrapper(
        NAME,
        MoveBaseAction,
        go_and_look(),
        succeeded_outcomes=["succeeded"],
        preempted_outcomes=["preempted"],  # also if the mission was preempted, not this goal
        goal_slots_map={"target_pose": "place"},  # field of the goal -> userdata key
        feedback_key="feedback",
    )
    server.run_server()
    return server


@smachpy.mission(serves=[NAME])
def look_at(x: float = 11.5, y: float = 8.0) -> StateMachine:
    """Offer the action look_at and send it one goal.

    Args:
        x: The goal's x [m], map frame.
        y: The goal's y [m], map frame.
    """
    send = SimpleActionState(NAME, MoveBaseAction, goal_at(Pose2D(x, y, 0.0)), exec_timeout=900.0)
    sm = StateMachine(ENDS, name="LOOK_AT")
    sm.add("SEND", send)
    serve_during(sm, offer)  # starts the server with each run and stops it at the run's end
    return sm


def server() -> StateMachine:
    """Offer the action look_at until Ctrl-C, without a client."""
    return serving_machine("LOOK_AT_SERVER", offer)
