"""States that drive the robot with `move_base`, and conversions of its messages."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Final

from actionlib_core.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.interfaces.std_msgs.msg import Header
from smachpy.actions.simple_action_state import SimpleActionState
from smachpy.actions.wakeup import Wakeup, answer_preempt
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.problems import Problems, as_number
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State
from smachpy.places.pose import Pose2D, quaternion_of
from smachpy.states.localising import MAP_FRAME, Localiser, pose_of, pose_problem

if TYPE_CHECKING:
    from typing import Unpack

    from smachpy.events.introspection import Kind
    from smachpy.machines.state import StateOptions
    from smachpy.userdata.user_data import UserData

SIGNAL_TIMEOUT: Final = 5.0  # [s] a robot's own topic that is silent for this long is not there
DRIVE_TIMEOUT: Final = 600.0  # [s] longer than any drive in a building
TURN_TIMEOUT: Final = 60.0  # [s]
_POSE: Final = ("x", "y", "yaw")


def goal_at(pose: Pose2D, frame: str = MAP_FRAME) -> MoveBaseGoal:
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


def place_of(value: Any, where: str) -> tuple[Pose2D, str]:
    """Return the pose [m, m, rad] of a place, and its frame.

    Args:
        value: A `Pose2D` or `Waypoint` in the map frame, a mapping with `x`, `y` and maybe `yaw`,
            as files have it, a `Pose`, or a `PoseStamped`.
        where: Where the value is from, for the error.

    Raises:
        InvalidStateError: it is a pose that nobody has filled in, or no place at all.
    """
    pose, header = getattr(value, "pose", value), getattr(value, "header", None)
    frame = MAP_FRAME if header is None else header.frame_id or MAP_FRAME
    if isinstance(pose, Pose2D):
        return pose, frame
    if isinstance(value, Mapping):
        numbers = [as_number(value.get(key, 0.0 if key == "yaw" else None)) for key in _POSE]
        x, y, yaw = (math.nan if number is None else number for number in numbers)
        if not all(map(math.isfinite, (x, y, yaw))):
            raise InvalidStateError(f"{where}: got {value!r}; expected numbers {', '.join(_POSE)}.")
        return Pose2D(x, y, yaw), frame
    if not (hasattr(pose, "position") and hasattr(pose, "orientation")):
        raise InvalidStateError(
            f"{where}: got {value!r}; expected a Pose2D, Waypoint, Pose, PoseStamped, or x and y."
        )
    problem = pose_problem(pose)
    if problem:
        raise InvalidStateError(f"{where}: {problem}.")
    return pose_of(pose), frame


def drive_to(
    place: Pose2D | str, *, action: str = "move_base", **options: Any
) -> SimpleActionState:
    """Return a state that drives to a place. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        place: A pose [m, m, rad] in the map frame; or the userdata key of one, see
            `place_of`; the header of a `PoseStamped` names another frame.
        action: Name of the action.
        **options: Those of `SimpleActionState`; the default of `exec_timeout` is 600 s.

    Raises:
        InvalidStateError: an argument is wrong.
    """
    options.setdefault("exec_timeout", DRIVE_TIMEOUT)
    if not isinstance(place, str):
        return SimpleActionState(action, MoveBaseAction, goal=goal_at(place), **options)

    def goal(userdata: UserData, _default: MoveBaseGoal) -> MoveBaseGoal:
        return goal_at(*place_of(userdata[place], f"{current_path() or 'drive_to'}: {place}"))

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


def locate(key: str = "here", topic: str = "odom", **options: Unpack[StateOptions]) -> Locate:
    """Return a state that writes the robot's pose in the map frame to a userdata key.

    Outcomes: 'valid', 'invalid', 'preempted', 'aborted'; see `Locate`.

    Args:
        key: The userdata key that gets the pose, a `Pose2D` [m, m, rad].
        topic: A topic of `nav_msgs/Odometry`. Its frame need not be the map: the transforms on
            `/tf` and `/tf_static`, which a localisation sends, are applied.
        **options: See `smachpy.machines.state.StateOptions`.
    """
    return Locate(key, topic, **options)


class Locate(State):
    """Writes the robot's pose in the map frame to a userdata key.

    Outcomes: 'valid'; 'aborted' after 5 s without odometry; 'invalid' if there is odometry, but
    after 5 s it still has no place in the map, which is logged with the reason; 'preempted'.

    Args:
        key: The userdata key that gets the pose, a `Pose2D` [m, m, rad].
        topic: A topic of `nav_msgs/Odometry`.
        **options: See `smachpy.machines.state.StateOptions`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """

    _smachpy_kind: ClassVar[Kind] = "monitor"

    def __init__(
        self, key: str = "here", topic: str = "odom", **options: Unpack[StateOptions]
    ) -> None:
        problems = Problems("Locate")
        self.__key = problems.word("key", key)
        self.__topic = problems.network_name("topic", topic)
        with problems:
            super().__init__(("valid", "invalid", "preempted", "aborted"), (), [key], **options)
        problems.raise_all()

    def execute(self, userdata: UserData) -> str:
        """Wait for the pose.

        Blocks: 5 s at most, or until a preempt.
        """
        with Wakeup(self) as wake:
            localiser = Localiser(self.__topic, changed=wake.set)
            try:
                until = wake.clock.now() + SIGNAL_TIMEOUT
                while not answer_preempt(self):
                    wake.clear()
                    pose, problem = localiser.pose()
                    if pose is not None:
                        userdata[self.__key] = pose
                        return "valid"
                    if wake.clock.now() >= until:
                        log.logwarn(f"{current_path()}: {problem}.")
                        return "invalid" if localiser.heard else "aborted"
                    wake.wait_until(until)
            finally:
                localiser.close()
        return "preempted"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic and the limit."""
        kind, details = super().describe_details()
        limit = f"{SIGNAL_TIMEOUT:g} s -> aborted"
        own = (("topic", self.__topic), ("type", Odometry._type), ("checks", "1"))
        return kind, (*own, ("timeout", limit), *details)
