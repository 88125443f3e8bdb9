"""Small states that several missions have in common."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.topic import Subscriber
from missions.move_base.geometry import Pose2D, yaw_of
from missions.waypoint_file import goal_at
from smachpy import MonitorState, SimpleActionState, State, UserData

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces.geometry_msgs.msg import Pose
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseGoal
    from smachpy.introspection import Kind

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


class AwaitMessage(State):
    """Wait for a message that is as wanted. Outcomes: 'came', 'timeout', 'preempted'.

    Args:
        topic: Name of the topic.
        msg_type: Class of its messages.
        wanted: Called with each message, in the subscriber's thread; true ends the wait.
        timeout: Longest wait [s].
    """

    def __init__(
        self, topic: str, msg_type: Any, wanted: Callable[[Any], bool], *, timeout: float
    ) -> None:
        super().__init__(outcomes=["came", "timeout", "preempted"])
        self._topic = topic
        self._msg_type = msg_type
        self._wanted = wanted
        self._patience = timeout

    def execute(self, userdata: UserData) -> str:
        """Wait.

        Blocks: until the message, `timeout` or a preempt.
        """
        del userdata
        came: list[bool] = []
        wake = self._clock().event(f"a message on {self._topic}")

        def on_message(message: Any) -> None:
            if self._wanted(message):
                came.append(True)
                wake.set()

        forget = self._on_preempt(wake.set)
        try:
            with Subscriber(self._topic, self._msg_type, on_message):
                wake.wait(self._patience)
        finally:
            forget()
        if came:
            return "came"
        return "preempted" if self.preempt_requested() else "timeout"

    def describe_details(self) -> tuple[Kind, tuple[tuple[str, str], ...]]:
        """Add the topic and the limit."""
        _, details = super().describe_details()
        own = (("topic", self._topic), ("timeout", f"{self._patience:g} s -> timeout"))
        return "monitor", (*own, *details)


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
