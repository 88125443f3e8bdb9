"""Robot actions as commands: go to a pose, stop, turn.

    RP_ACTION
      GO           drives to a place
      TURN_LEFT    turns by 90 degrees, relative to the current heading
      FACE_EAST    turns to the heading 0, the shorter way
      GO_AND_STOP  runs both at once; the drive that is cancelled ends as 'stopped'
        GO_FAR     drives away
        STOP       WAIT -> CANCEL -> STAND

Run all of it: `smachpy run rp_action --start-robot`. As commands, for a running robot:

    smachpy run rp_action.gotopose -- robot_0 10 2 0
    smachpy run rp_action.stopmove -- robot_0
    smachpy run rp_action.turn -- -server robot_0
    smachpy run rp_action.turn -- -client robot_0 90 REL
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import smachpy
from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.msg import Odometry
from actionlib_core.names import check_name
from smachpy import (
    Concurrence,
    SimpleActionState,
    State,
    StateMachine,
    UserData,
    logerr,
)
from smachpy.states import (
    AwaitMessage,
    MissionError,
    Pose2D,
    Wait,
    drive_to,
    serve_during,
    serving_machine,
)
from smachpy_missions.course.turn_server import TurnServer, goal_trouble
from smachpy_missions.interfaces import TurnAction, TurnGoal

if TYPE_CHECKING:
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseResult

OUTCOMES = ["succeeded", "aborted", "preempted"]
SERVER_WAIT = 3.0  # [s] to find a robot's action server
BRAKING = 5.0  # [s] after a stop, the robot stands still within this time
TURN_TIMEOUT = 120.0  # [s] two full turns at 6 deg/s
STANDING = 0.01  # [m/s, rad/s] below this the robot counts as standing: odometry has noise


@smachpy.mission(serves=["turn"])
def rp_action(seconds: float = 2.0) -> StateMachine:
    """Go to a pose, turn, and be stopped on the way.

    Args:
        seconds: When the last drive is stopped [s].

    Raises:
        MissionError: `seconds` is not a positive, finite duration.
    """
    if not 0.0 < seconds < math.inf:
        raise MissionError(f"seconds: got {seconds:g}; expected more than 0.")
    sm = StateMachine(OUTCOMES, name="RP_ACTION")
    serve_during(sm, TurnServer)
    with sm:
        sm.add("GO", go("", 11.5, 8.0, 90.0), {"succeeded": "TURN_LEFT"})
        sm.add("TURN_LEFT", turn_by(90.0, "REL"), {"succeeded": "FACE_EAST"})
        sm.add("FACE_EAST", turn_by(0.0, "ABS"), {"succeeded": "GO_AND_STOP"})
        sm.add("GO_AND_STOP", go_and_stop(seconds))
    return sm


# -- the commands ----------------------------------------------------------------------------------


def gotopose(robot: str, x: float, y: float, theta: float = 0.0) -> StateMachine:
    """Drive a robot to a pose on the map.

    Args:
        robot: Its name, which is the prefix of its actions and topics.
        x: The goal's x [m].
        y: The goal's y [m].
        theta: The goal's heading [deg], anticlockwise from the x axis.

    Raises:
        MissionError: a coordinate is not finite.
        InvalidNameError: `robot` is not a valid name.
    """
    sm = StateMachine(OUTCOMES, name="GOTOPOSE")
    with sm:
        sm.add("GO", go(robot_prefix(robot), x, y, theta))
    return sm


def stopmove(robot: str) -> StateMachine:
    """Stop a robot: cancel all goals that drive or turn it.

    Args:
        robot: Its name.

    Raises:
        InvalidNameError: `robot` is not a valid name.
    """
    return stop(robot_prefix(robot), "STOPMOVE")


def turn(
    angle: float | None = None,
    reference: str = "REL",
    max_ang_vel: float = 0.0,
    *,
    client: str = "",
    server: str = "",
) -> StateMachine:
    """Turn a robot (-client NAME), or offer the action (-server NAME).

    Args:
        angle: The angle or heading [deg], anticlockwise.
        reference: REL: turn by this angle; ABS: turn to this heading, the shorter way.
        max_ang_vel: The largest turn rate [deg/s]; 0: the server's own limit.
        client: The robot to turn.
        server: The robot to offer the action for, until Ctrl-C.

    Raises:
        MissionError: neither or both robots are given, or the turn is out of range.
        InvalidNameError: a robot's name is not valid.
    """
    if bool(client) == bool(server):
        given = f"-client {client} and -server {server}" if client else "neither"
        raise MissionError(
            f"turn: got {given}; expected one of -client ROBOT and -server ROBOT. "
            "Try: smachpy run rp_action.turn -- -client robot_0 90 REL"
        )
    if server:
        return serving_machine("TURN_SERVER", partial(TurnServer, robot_prefix(server)))
    if angle is None:
        raise MissionError("angle: got none; expected degrees. Try: -- -client robot_0 90 REL")
    sm = StateMachine(OUTCOMES, name="TURN_ROBOT")
    with sm:
        sm.add("TURN", turn_by(angle, reference, max_ang_vel, robot_prefix(client)))
    return sm


def robot_prefix(robot: str) -> str:
    """Return the prefix of a robot's actions and topics.

    Raises:
        InvalidNameError: `robot` is not a valid name.
    """
    return f"{check_name(robot, 'robot name')}/"


# -- their states ----------------------------------------------------------------------------------


def go(prefix: str, x: float, y: float, theta: float) -> SimpleActionState:
    """Drive to a place [m] and a heading [deg]."""
    return drive_to(Pose2D(*checked_pose(x, y, theta)), action=f"{prefix}move_base")


def checked_pose(x: float, y: float, theta: float) -> tuple[float, float, float]:
    """Return a pose with its heading in radians.

    Raises:
        MissionError: a value is not finite.
    """
    for name, value in (("x", x), ("y", y), ("theta", theta)):
        if not math.isfinite(value):
            raise MissionError(f"{name}: got {value}; expected a finite number.")
    return x, y, math.radians(theta)


def turn_by(
    angle: float, reference: str, max_ang_vel: float = 0.0, prefix: str = ""
) -> SimpleActionState:
    """Turn by or to an angle [deg].

    Raises:
        MissionError: the server would reject this goal.
    """
    goal = TurnGoal(angle, reference, max_ang_vel)
    trouble = goal_trouble(goal)
    if trouble:
        raise MissionError(trouble)
    return SimpleActionState(f"{prefix}turn", TurnAction, goal, exec_timeout=TURN_TIMEOUT)


def stop(prefix: str, name: str | None = None) -> StateMachine:
    """Cancel all goals of a robot, then wait until it stands still."""
    sm = StateMachine(OUTCOMES, name=name)
    with sm:
        sm.add("CANCEL", CancelAll(prefix), {"asked": "STAND"})
        standing = AwaitMessage(f"{prefix}odom", Odometry, stands, timeout=BRAKING)
        sm.add("STAND", standing, {"came": "succeeded", "timeout": "aborted"})
    return sm


def stands(odometry: Odometry) -> bool:
    """Return whether the robot neither drives nor turns."""
    twist = odometry.twist.twist
    return math.hypot(twist.linear.x, twist.linear.y) < STANDING > abs(twist.angular.z)


class CancelAll(State):
    """Cancels all goals of a robot's servers, whichever client sent them.

    A robot without a turn server has only its drives cancelled.
    """

    def __init__(self, prefix: str) -> None:
        super().__init__(outcomes=["asked", "aborted", "preempted"])
        self._prefix = prefix

    def execute(self, userdata: UserData) -> str:
        """Send both cancels.

        Blocks: for `SERVER_WAIT` seconds at most.
        """
        del userdata
        drive = SimpleActionClient(f"{self._prefix}move_base", MoveBaseAction)
        turning = SimpleActionClient(f"{self._prefix}turn", TurnAction)
        try:
            if not drive.wait_for_server(SERVER_WAIT):
                logerr(
                    f"{self._prefix}move_base: got no server within {SERVER_WAIT:g} s; expected "
                    "one. `actionlib list` shows those that run."
                )
                return "aborted"
            drive.cancel_all_goals()
            turning.cancel_all_goals()
        finally:
            drive.stop()
            turning.stop()
        return "asked"


def go_and_stop(seconds: float) -> Concurrence:
    """Drive far away, and stop the drive from a second branch after some seconds."""
    both = Concurrence(
        outcomes=OUTCOMES,
        default_outcome="aborted",
        outcome_map={"succeeded": {"GO_FAR": "stopped", "STOP": "succeeded"}},
    )
    stopping = StateMachine(OUTCOMES)
    stopping.add("WAIT", Wait(seconds), {"done": "STOP"})
    stopping.add("STOP", stop(""))
    far = drive_to(Pose2D(16.5, 10.4, 0.0), outcomes=["stopped"], result_cb=name_the_stop)
    both.add("GO_FAR", far)
    both.add("STOP", stopping)
    return both


def name_the_stop(_userdata: UserData, status: int, _result: MoveBaseResult) -> str | None:
    """Return the outcome for a goal that another client cancelled."""
    return "stopped" if status == GoalStatus.PREEMPTED else None
