"""There and back: send a goal, stop the robot after three seconds, send it back where it began.

    THERE_AND_BACK
      REMEMBER   where the robot stands now
      GO         to the goal; cancelled after `seconds`
      COME_BACK  to where it stood

Run it: `smachpy run there_and_back --start-robot`
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from missions.exceptions import MissionError
from missions.move_base.geometry import Pose2D
from missions.waypoint_file import goal_at
from smachpy import MonitorState, SimpleActionState, StateMachine, UserData
from smachpy.checks import ignore

if TYPE_CHECKING:
    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped


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
        MissionError: that is no time.
    """
    if not 0.0 < seconds < math.inf:
        raise MissionError(f"seconds: got {seconds:g}; expected more than 0.")
    here = MonitorState("odom", Odometry, remember, max_checks=1, output_keys=["home"])
    back = SimpleActionState("move_base", MoveBaseAction, goal_cb=home_goal, input_keys=["home"])
    sm = StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="THERE_AND_BACK")
    with sm:
        StateMachine.add(
            "REMEMBER",
            ignore(here, "no-timeout", "the robot may be switched on after the mission"),
            transitions={"valid": "GO", "invalid": "aborted"},
        )
        StateMachine.add(
            "GO",
            SimpleActionState(
                "move_base",
                MoveBaseAction,
                goal=goal_at(Pose2D(x, y, yaw)),
                timeout=seconds,
                timeout_outcome="stopped",
            ),
            transitions={"succeeded": "COME_BACK", "stopped": "COME_BACK"},
        )
        StateMachine.add(
            "COME_BACK",
            ignore(back, "no-timeout", "a robot that cannot go on aborts, a dead one is seen"),
        )
    return sm


def remember(userdata: UserData, odometry: Odometry) -> bool:
    """Keep the pose where the robot stands."""
    userdata.home = odometry.pose.pose
    return True


def home_goal(userdata: UserData, goal: MoveBaseGoal) -> MoveBaseGoal:
    """Make the goal that drives back."""
    target: PoseStamped = goal.target_pose
    target.header.frame_id = "map"
    target.pose = userdata.home
    return goal
