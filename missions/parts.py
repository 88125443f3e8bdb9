"""Small states that several missions have in common."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from missions.move_base.geometry import Pose2D, yaw_of
from missions.waypoint_file import goal_at
from smachpy import MonitorState, SimpleActionState, State, UserData

if TYPE_CHECKING:
    from actionlib_core.interfaces.geometry_msgs.msg import Pose
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal

SIGNAL_TIMEOUT: Final = 5.0  # [s] the robot's own topics answer within this, or never
DRIVE_TIMEOUT: Final = 600.0  # [s] no way in a building takes longer
TURN_TIMEOUT: Final = 60.0  # [s]


def pose_of(message: Pose) -> Pose2D:
    """Return a pose message as place and heading."""
    turn = message.orientation
    yaw = yaw_of(turn.x, turn.y, turn.z, turn.w)
    return Pose2D(message.position.x, message.position.y, yaw)


def locate() -> MonitorState:
    """Write where the robot is to the userdata key `here`. Outcomes: 'valid', 'aborted', ..."""
    return MonitorState(
        "odom",
        Odometry,
        note_pose,
        max_checks=1,
        output_keys=["here"],
        timeout=SIGNAL_TIMEOUT,
        latest=True,
    )


def note_pose(userdata: UserData, odometry: Odometry) -> bool:
    """Keep the pose of an odometry message."""
    userdata.here = pose_of(odometry.pose.pose)
    return True


def drive_to(pose: Pose2D, **options: Any) -> SimpleActionState:
    """Drive to a pose in the map frame."""
    options.setdefault("exec_timeout", DRIVE_TIMEOUT)
    return SimpleActionState("move_base", MoveBaseAction, goal=goal_at(pose), **options)


def drive_back() -> SimpleActionState:
    """Drive to the pose in the userdata key `home`, trying three times."""

    def home_goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
        return goal_at(userdata.home)

    return SimpleActionState(
        "move_base",
        MoveBaseAction,
        goal_cb=home_goal,
        input_keys=["home"],
        exec_timeout=DRIVE_TIMEOUT,
        retry=(3, 5.0, ["aborted"]),
    )


def turn(degrees: float, **options: Any) -> SimpleActionState:
    """Turn on the spot, anticlockwise, by at most half a circle; the shorter way round."""
    pose = Pose2D(0.0, 0.0, math.radians(degrees))
    goal = goal_at(pose, frame="base_link")
    options.setdefault("exec_timeout", TURN_TIMEOUT)
    return SimpleActionState("move_base", MoveBaseAction, goal=goal, **options)


class Wait(State):
    """Let some time pass. Outcomes: 'done', 'preempted'.

    Args:
        seconds: How long [s]; None takes the userdata key `seconds`.
    """

    def __init__(self, seconds: float | None = None) -> None:
        keys = ["seconds"] if seconds is None else []
        super().__init__(outcomes=["done", "preempted"], input_keys=keys)
        self.seconds = seconds

    def execute(self, userdata: UserData) -> str:
        """Wait, unless called off."""
        seconds = userdata.seconds if self.seconds is None else self.seconds
        return "preempted" if self.sleep(seconds) else "done"
