"""Lesson 11, a machine as an action server: other programs send goals, the machine runs them.

For each goal LOOK_AT_SERVER drives to its pose, and turns round. A cancel preempts it.
Run it: `smachpy run look_at --start-robot`; it sends one goal, as another program would
"""

import smachpy
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from smachpy.states import Pose2D, drive_to, goal_at, serve_during, turn

ENDS = ["succeeded", "aborted", "preempted"]


def look() -> smachpy.StateMachine:
    """Drive to the pose in the userdata key `target_pose`, and turn round."""
    sm = smachpy.StateMachine(outcomes=ENDS, input_keys=["target_pose"], name="LOOK_AT_SERVER")
    with sm:
        sm.add("DRIVE", drive_to("target_pose"), transitions={"succeeded": "TURN"})
        sm.add("TURN", turn(180.0))
    return sm


def offer() -> smachpy.ActionServerWrapper:
    """Offer the action; `expand_goal_slots` copies the goal's fields to keys of the same name."""
    wrapper = smachpy.ActionServerWrapper(
        "look_at",
        MoveBaseAction,
        look(),
        succeeded_outcomes=["succeeded"],
        preempted_outcomes=["preempted"],
        expand_goal_slots=True,
    )
    wrapper.run_server()
    return wrapper


@smachpy.mission(serves=["look_at"])
def look_at(x: float = 11.5, y: float = 8.0) -> smachpy.StateMachine:
    """Offer the action look_at and send it one goal: (x, y) [m] on the map."""
    send = smachpy.SimpleActionState("look_at", MoveBaseAction, goal=goal_at(Pose2D(x, y, 0.0)))
    sm = smachpy.StateMachine(outcomes=ENDS, name="LOOK_AT")
    serve_during(sm, offer)  # from the start of each run to its end
    with sm:
        sm.add("SEND", send)
    return sm
