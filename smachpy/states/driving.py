"""States that drive the robot with `move_base`, and conversions of its messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Header
from smachpy import InvalidStateError, MonitorState, SimpleActionState
from smachpy.context import current_path
from smachpy.machines.problems import as_number
from smachpy.sim.geometry import Pose2D, quaternion_of, yaw_of

if TYPE_CHECKING:
    from smachpy import UserData

SIGNAL_TIMEOUT: Final = 5.0  # [s] a robot's own topic that is silent for this long is not there
DRIVE_TIMEOUT: Final = 600.0  # [s] longer than any drive in a building
TURN_TIMEOUT: Final = 60.0  # [s]


def goal_at(pose: Pose2D, frame: str = "map") -> MoveBaseGoal:
    """Return the `move_base` goal that drives to a pose.

    Args:
        pose: The pose [m, m, rad].
        frame: Its frame, which the robot must know. In "base_link" x is ahead of the robot.

    Raises:
        InvalidStateError: `pose` is no `Pose2D`, or has a number that is not finite.
    """
    numbers = [as_number(value) for value in pose] if isinstance(pose, Pose2D) else [None]
    if not all(number is not None and math.isfinite(number) for number in numbers):
        where = current_path() or "goal_at"
        raise InvalidStateError(
            f"{where}: pose: got {pose!r}; expected a Pose2D of finite numbers."
        )
    heading = Quaternion(*quaternion_of(pose.yaw))
    there = Pose(position=Point(pose.x, pose.y, 0.0), orientation=heading)
    return MoveBaseGoal(target_pose=PoseStamped(header=Header(frame_id=frame), pose=there))


def pose_of(message: Pose) -> Pose2D:
    """Return position and heading [m, m, rad] of a pose message, in the message's frame."""
    turned = message.orientation
    yaw = yaw_of(turned.x, turned.y, turned.z, turned.w)
    return Pose2D(message.position.x, message.position.y, yaw)


def drive_to(
    place: Pose2D | str, *, action: str = "move_base", **options: Any
) -> SimpleActionState:
    """Return a state that drives to a place. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        place: A pose [m, m, rad] in the map frame; or the userdata key of one: a `Pose2D`, a
            `Waypoint`, a `Pose`, or a `PoseStamped`, whose header names another frame.
        action: Name of the action.
        **options: Those of `SimpleActionState`; the default of `exec_timeout` is 600 s.

    Raises:
        InvalidStateError: an argument is wrong.
    """
    options.setdefault("exec_timeout", DRIVE_TIMEOUT)
    if not isinstance(place, str):
        return SimpleActionState(action, MoveBaseAction, goal=goal_at(place), **options)

    def goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
        value = userdata[place]
        pose = getattr(value, "pose", value)
        header = getattr(value, "header", None)
        frame = "map" if header is None else header.frame_id or "map"
        return goal_at(pose if isinstance(pose, Pose2D) else pose_of(pose), frame)

    keys = [*options.pop("input_keys", ()), place]
    return SimpleActionState(action, MoveBaseAction, goal_cb=goal, input_keys=keys, **options)


def drive_back(key: str = "home") -> SimpleActionState:
    """Return a state that drives to the pose in a userdata key, with up to three attempts.

    The pauses before the second and third attempt are 5 s and 10 s; the rest is as in `drive_to`.
    """
    return drive_to(key, retry=(3, 5.0, ["aborted"]))


def turn(degrees: float, **options: Any) -> SimpleActionState:
    """Return a state that turns on the spot. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        degrees: The angle [deg], anticlockwise. The robot turns the shorter way, so use two states
            for more than 180.
        **options: Those of `SimpleActionState`; the default of `exec_timeout` is 60 s.

    Raises:
        InvalidStateError: an argument is wrong.
    """
    number = as_number(degrees)
    if number is None or not math.isfinite(number):
        raise InvalidStateError(f"turn: degrees: got {degrees!r}; expected a finite number.")
    options.setdefault("exec_timeout", TURN_TIMEOUT)
    goal = goal_at(Pose2D(0.0, 0.0, math.radians(number)), frame="base_link")
    return SimpleActionState("move_base", MoveBaseAction, goal=goal, **options)


def locate(key: str = "here", topic: str = "odom") -> MonitorState:
    """Return a state that writes the robot's pose to a userdata key.

    Outcomes: 'valid', 'invalid', 'preempted', and 'aborted' after 5 s without odometry.

    Args:
        key: The userdata key that gets the pose, a `Pose2D` [m, m, rad]. It is in the odometry's
            frame, usually "odom"; `drive_to` takes it for the map frame. With odometry that drifts,
            name a topic with odometry in the map frame.
        topic: A topic of `nav_msgs/Odometry`.
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
