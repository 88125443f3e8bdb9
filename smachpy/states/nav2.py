"""States for a robot's navigation: Nav2 and, where it has the same, ROS 1's move_base."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, Literal

from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus
from actionlib_core.interfaces.std_srvs.srv import Empty
from smachpy.actions.service_state import ServiceState
from smachpy.actions.simple_action_state import SimpleActionState
from smachpy.base import log
from smachpy.base.context import current_path
from smachpy.base.problems import Problems, unknown_name
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state_machine import StateMachine
from smachpy.states.driving import goal_at, place_of
from smachpy.states.waiting import Wait

if TYPE_CHECKING:
    from actionlib_core.time import Duration
    from smachpy.machines.state import State
    from smachpy.userdata.user_data import UserData

ASKED_EVERY_S = 1.0
ANSWER_S = 5.0
CLEAR_S: Final = 10.0  # [s]
DOCK_S: Final = 300.0  # [s] the drive to the staging pose and a few attempts
UNDOCK_S: Final = 60.0  # [s]
ENDS: Final = ("succeeded", "aborted", "preempted")


def nav2_active(
    *, manager: str = "lifecycle_manager_navigation", timeout: float | None = 60.0
) -> StateMachine:
    """Return a machine that waits until Nav2 is active.

    Outcomes: 'succeeded', 'aborted', 'preempted'.

    It asks Nav2's lifecycle manager (`<manager>/is_active`) once a second, like Nav2's own
    programs, because the manager does not announce when it is done. 'aborted': not active within
    `timeout`.

    Args:
        manager: Name of the manager's node; "lifecycle_manager_localization" is another.
        timeout: Longest wait [s]; None: no limit.
    """

    def on_response(_userdata: UserData, response: Any) -> str:
        return "succeeded" if response.success else "aborted"

    machine = StateMachine(outcomes=ENDS, timeout=timeout, timeout_outcome="aborted")
    trigger = ros2.get_service("std_srvs/Trigger")
    ask = ServiceState(f"{manager}/is_active", trigger, response_cb=on_response, timeout=ANSWER_S)
    machine.add("ASK", ask, {"succeeded": "succeeded", "aborted": "WAIT", "preempted": "preempted"})
    machine.add("WAIT", Wait(ASKED_EVERY_S), {"done": "ASK", "preempted": "preempted"})
    return machine


def clear_costmaps(
    *,
    navigation: Literal["nav2", "move_base"] = "nav2",
    namespace: str = "",
    timeout: float | Duration | None = CLEAR_S,
) -> State:
    """Return a state that lets the navigation forget all obstacles.

    Outcomes: 'succeeded', 'aborted' (one is not there, or does not answer), 'preempted'.

    Args:
        navigation: "nav2": it calls `global_costmap/clear_entirely_global_costmap` and then
            `local_costmap/clear_entirely_local_costmap`; "move_base", of ROS 1: it calls
            `move_base/clear_costmaps`.
        namespace: Prefix of these names, "robot_0" for example.
        timeout: Longest time for each call [s], including the wait for the service; None: no limit.

    Raises:
        InvalidStateError: an argument is wrong.
    """
    if navigation not in {"nav2", "move_base"}:
        problem = unknown_name("navigation", navigation, ("nav2", "move_base"))
        raise InvalidStateError(f"clear_costmaps: {problem}")
    prefix = f"{namespace.rstrip('/')}/" if namespace else ""
    if navigation == "move_base":
        return ServiceState(f"{prefix}move_base/clear_costmaps", Empty, timeout=timeout)
    clear: Any = ros2.get_service("nav2_msgs/ClearEntireCostmap")

    def on_response(_userdata: UserData, response: Any) -> str:
        return "succeeded" if getattr(response, "success", True) else "aborted"  # since Lyrical

    machine = StateMachine(outcomes=ENDS)
    for which, then in (("global", "LOCAL"), ("local", "succeeded")):
        name = f"{prefix}{which}_costmap/clear_entirely_{which}_costmap"
        state = ServiceState(name, clear, response_cb=on_response, timeout=timeout)
        machine.add(which.upper(), state, {"succeeded": then})
    return machine


def dock(
    dock_id: str = "",
    *,
    place: Any = None,
    dock_type: str = "",
    navigate: bool = True,
    action: str = "dock_robot",
    **options: Any,
) -> SimpleActionState:
    """Return a state that docks the robot by Nav2. Outcomes: 'succeeded', 'aborted', 'preempted'.

    An error of the docking server is in the log, with its name.

    Args:
        dock_id: The dock's name in the robot's database of docks; or give its place.
        place: The dock's place, instead, as for `follow_waypoints`; or the userdata key of one.
        dock_type: The plugin for that dock; needed with a place if the robot has several.
        navigate: Drive to the staging pose in front of the dock first.
        action: Name of the action, of type `nav2_msgs/DockRobot`.
        **options: Those of `SimpleActionState` without `goal_*` and `result_cb`; the default of
            `exec_timeout` is 300 s.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
        InterfaceError: the distribution has no such action (Humble).
    """
    problems = Problems("dock")
    if bool(dock_id) == (place is not None):
        problems.add("dock_id, place: got both or none; expected one of them.")
    goal = _action("DockRobot").Goal(dock_type=dock_type, navigate_to_staging_pose=navigate)
    if dock_id:
        goal.dock_id = problems.word("dock_id", dock_id)
    with problems:
        if place is not None and not isinstance(place, str):
            goal.dock_pose = _stamped(place, "place")
    problems.raise_all()
    goal.use_dock_id = bool(dock_id)

    def fill(userdata: UserData, goal: Any) -> Any:
        if isinstance(place, str):
            goal.dock_pose = _stamped(userdata[place], f"{current_path() or 'dock'}: {place}")
        return goal

    keys = [*options.pop("input_keys", ()), *([place] if isinstance(place, str) else ())]
    options.setdefault("exec_timeout", DOCK_S)
    return _state(action, "DockRobot", goal, fill, input_keys=keys, **options)


def undock(
    dock_type: str = "", *, action: str = "undock_robot", **options: Any
) -> SimpleActionState:
    """Return a state that undocks the robot by Nav2. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        dock_type: The plugin for the dock; "" for that of the dock where it has docked.
        action: Name of the action, of type `nav2_msgs/UndockRobot`.
        **options: As for `dock`; the default of `exec_timeout` is 60 s.

    Raises:
        InterfaceError: the distribution has no such action (Humble).
    """
    options.setdefault("exec_timeout", UNDOCK_S)
    goal = _action("UndockRobot").Goal(dock_type=dock_type)
    return _state(action, "UndockRobot", goal, **options)


def follow_waypoints(
    places: Sequence[Any] | str,
    *,
    loops: int = 0,
    missed_key: str | None = None,
    action: str = "follow_waypoints",
    **options: Any,
) -> SimpleActionState:
    """Return a state that drives through places by Nav2, which may do something at each of them.

    Outcomes: 'succeeded'; 'missed': it has ended, but not been at all of them; 'aborted';
    'preempted'.

    Args:
        places: The places: each a `Pose2D` [m, m, rad] or `Waypoint` in the map frame, a `Pose`, or
            a `PoseStamped`; or the userdata key of such a list.
        loops: How often it goes round again; not on Humble.
        missed_key: Userdata key that gets the indices of the places that it has missed, a list.
        action: Name of the action, of type `nav2_msgs/FollowWaypoints`.
        **options: Those of `SimpleActionState` without `goal_*` and `result_cb`; there is no limit
            of time unless you give `exec_timeout`.

    Raises:
        InvalidStateError: an argument is wrong; all problems at once.
    """
    problems = Problems("follow_waypoints")
    goal = _action("FollowWaypoints").Goal()
    number = problems.whole("loops", loops, 0, "a number of rounds, 0 or more")
    if number and "number_of_loops" not in goal.__slots__:
        problems.add(
            f"loops: got {loops}; expected 0, as Nav2 of {ros2.default_distro()} has none."
        )
    elif number:
        goal.number_of_loops = number

    def poses(given: Any, where: str) -> list[Any]:
        if isinstance(given, str) or not isinstance(given, Sequence) or not given:
            raise InvalidStateError(
                f"{where}: got {given!r}; expected a list of places, not empty."
            )
        return [_stamped(place, f"{where}: [{index}]") for index, place in enumerate(given)]

    with problems:
        if not isinstance(places, str):
            goal.poses = poses(places, "places")
    problems.raise_all()

    def fill(userdata: UserData, goal: Any) -> Any:
        if isinstance(places, str):
            where = f"{current_path() or 'follow_waypoints'}: {places}"
            goal.poses = poses(userdata[places], where)
        return goal

    def judge(userdata: UserData, status: int, result: Any) -> str | None:
        # Humble lists numbers, later distributions messages with an index.
        missed = [getattr(each, "index", each) for each in result.missed_waypoints]
        if missed_key is not None:
            userdata[missed_key] = missed
        return "missed" if missed and status == GoalStatus.SUCCEEDED else None

    keys = [*options.pop("input_keys", ()), *([places] if isinstance(places, str) else ())]
    written = [*options.pop("output_keys", ()), *([] if missed_key is None else [missed_key])]
    outcomes = [*options.pop("outcomes", ()), "missed"]
    options |= {"input_keys": keys, "output_keys": written, "outcomes": outcomes}
    return _state(action, "FollowWaypoints", goal, fill, judge, **options)


def _action(name: str) -> Any:
    return ros2.get_action(f"nav2_msgs/{name}")


def _state(
    action: str, kind: str, goal: Any, fill: Any = None, judge: Any = None, **options: Any
) -> SimpleActionState:
    """Return a state for an action of Nav2, which logs the name of an error.

    Args:
        action: Name of the action.
        kind: Its type in nav2_msgs.
        goal: The goal.
        fill: Called as `fill(userdata, goal)` before it is sent.
        judge: Called as `judge(userdata, status, result)` at the end; may return the outcome.
        **options: Those of `SimpleActionState`.
    """

    def on_result(userdata: UserData, status: int, result: Any) -> str | None:
        code = getattr(result, "error_code", 0)
        if code and status != GoalStatus.SUCCEEDED:
            names = [
                name for name in dir(result) if name.isupper() and getattr(result, name) == code
            ]
            text = f": {result.error_msg}" if getattr(result, "error_msg", "") else ""
            log.logwarn(f"{current_path() or action}: {action}: {''.join(names)} ({code}){text}")
        return None if judge is None else judge(userdata, status, result)

    spec = _action(kind)
    return SimpleActionState(action, spec, goal, goal_cb=fill, result_cb=on_result, **options)


def _stamped(value: Any, where: str) -> Any:
    """Return the PoseStamped of ROS 2 for a place.

    Raises:
        InvalidStateError: it is no place.
    """
    target = goal_at(*place_of(value, where)).target_pose
    kind: Any = ros2.get_message("geometry_msgs/PoseStamped")
    stamped = kind()
    stamped.header.frame_id = target.header.frame_id
    for part in ("position", "orientation"):
        there, here = getattr(stamped.pose, part), getattr(target.pose, part)
        for field in here.__slots__:
            setattr(there, field, getattr(here, field))
    return stamped
