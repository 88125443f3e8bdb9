"""States that drive the robot with `move_base`, and conversions of its messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Header
from smachpy import MonitorState, SimpleActionState
from smachpy.sim.geometry import Pose2D, quaternion_of, yaw_of

if TYPE_CHECKING:
    from smachpy import UserData

SIGNAL_TIMEOUT: Final = 5.0  # [s] a robot's own topic that is silent for this long is not there
DRIVE_TIMEOUT: Final = 600.0  # [s] longer than any drive in a building
TURN_TIMEOUT: Final = 60.0  # [s]


def goal_at(pose: Pose2D, frame: str = "map") -> MoveBaseGoal:
    """Return the `move_base` goal that drives to a pose in the frame "map" or "base_link"."""
    heading = Quaternion(*quaternion_of(pose.yaw))
    there = Pose(position=Point(pose.x, pose.y, 0.0), orientation=heading)
    return MoveBaseGoal(target_pose=PoseStamped(header=Header(frame_id=frame), pose=there))


def pose_of(message: Pose) -> Pose2D:
    """Return position and heading of a pose message."""
    turned = message.orientation
    yaw = yaw_of(turned.x, turned.y, turned.z, turned.w)
    return Pose2D(message.position.x, message.position.y, yaw)


def drive_to(
    place: Pose2D | str, *, action: str = "move_base", **options: Any
) -> SimpleActionState:
    """Return a state that drives to a place. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        place: A pose in the map frame; or the userdata key of a pose: a `Pose2D`, a message, or an
            object with the attribute `pose`, such as a `Waypoint` or `PoseStamped`.
        action: Name of the action.
        **options: Those of `SimpleActionState`; the default of `exec_timeout` is 600 s.
    """
    options.setdefault("exec_timeout", DRIVE_TIMEOUT)
    if not isinstance(place, str):
        return SimpleActionState(action, MoveBaseAction, goal=goal_at(place), **options)

    def goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
        value = userdata[place]
        pose = getattr(value, "pose", value)
        return goal_at(pose if isinstance(pose, Pose2D) else pose_of(pose))

    keys = [*options.pop("input_keys", ()), place]
    return SimpleActionState(action, MoveBaseAction, goal_cb=goal, input_keys=keys, **options)


def drive_back(key: str = "home") -> SimpleActionState:
    """Return a state that drives to the pose in a userdata key, with up to three attempts."""
    return drive_to(key, retry=(3, 5.0, ["aborted"]))


def turn(degrees: float, **options: Any) -> SimpleActionState:
    """Return a state that turns on the spot, anticlockwise, by at most 180 degrees."""
    options.setdefault("exec_timeout", TURN_TIMEOUT)
    goal = goal_at(Pose2D(0.0, 0.0, math.radians(degrees)), frame="base_link")
    return SimpleActionState("move_base", MoveBaseAction, goal=goal, **options)


def locate(key: str = "here", topic: str = "odom") -> MonitorState:
    """Return a state that writes the robot's pose to a userdata key.

    Outcomes: 'valid', 'invalid', 'preempted', and 'aborted' after 5 s without odometry.
    """

    def note(userdata: UserData, odometry: Odometry) -> bool:
        userdata[key] = pose_of(odometry.pose.pose)
        return True

    return MonitorState(
        topic,
        Odometry,
        note,
        max_checks=1,
        output_keys=[key],
        timeout=SIGNAL_TIMEOUT,
        latest=True,
    )
