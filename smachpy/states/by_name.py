"""The ready-made states by their names in mission files: their arguments are plain data.

Other packages register theirs as entry points `smachpy.states`: a function of keyword arguments
that returns a state, with `Args:` in its docstring.
"""

from __future__ import annotations

import contextlib
import copy
from typing import TYPE_CHECKING, Any, Final, Literal

from smachpy.base.problems import Problems, unknown_name
from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actionlib_core.inputs.expression import Expression
    from smachpy.userdata.user_data import UserData


def wait(seconds: float | None = None) -> State:
    """Wait. Outcomes: 'done', 'preempted'.

    Args:
        seconds: How long [s]; without it the userdata key `seconds` says so.
    """
    from smachpy.states.waiting import Wait

    return Wait(seconds)


class SetKeys(State):
    """Writes values to userdata keys. Outcome: 'done'."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        super().__init__(["done"], output_keys=list(values))
        self.values = dict(values)

    def execute(self, userdata: UserData) -> str:
        """Write them."""
        for key, value in self.values.items():
            userdata[key] = copy.deepcopy(value)  # a later state may change it in place
        return "done"


def set_keys(**values: Any) -> State:
    """Write values to userdata keys. Outcome: 'done'.

    Args:
        **values: Key: value.
    """
    return SetKeys(values)


class Compute(State):
    """Computes userdata keys from others. Outcome: 'done'."""

    def __init__(self, expressions: Mapping[str, str]) -> None:
        from actionlib_core.inputs.expression import Expression, ExpressionError

        made = {}
        for key, text in expressions.items():
            try:
                made[key] = Expression(str(text))
            except ExpressionError as error:
                raise InvalidStateError(f"compute: {key}: {error}") from error
        names = dict.fromkeys(name for one in made.values() for name in sorted(one.names))
        super().__init__(["done"], input_keys=list(names), output_keys=list(made))
        self.expressions = made

    def execute(self, userdata: UserData) -> str:
        """Compute them, one after another."""
        for key, expression in self.expressions.items():
            userdata[key] = expression({name: userdata[name] for name in expression.names})
        return "done"


def compute(**expressions: str) -> State:
    """Compute userdata keys from others, one after another. Outcome: 'done'.

    Args:
        **expressions: Key: expression over the userdata, such as `index: "index + 1"`.
    """
    return Compute(expressions)


def drive_to(
    place: str | None = None,
    x: float | None = None,
    y: float | None = None,
    yaw: float | None = None,
    action: str = "move_base",
    exec_timeout: float = 600.0,
) -> State:
    """Drive to a place. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        place: The userdata key of a pose, or of a mapping with x, y and maybe yaw; or give x and y.
        x: Position in the map frame [m].
        y: Position in the map frame [m].
        yaw: Heading there [rad]; 0 unless given.
        action: Name of the action.
        exec_timeout: Longest drive [s].
    """
    from smachpy.places.pose import Pose2D
    from smachpy.states.driving import drive_to as driving

    given = [name for name, value in (("x", x), ("y", y), ("yaw", yaw)) if value is not None]
    if place is not None and given:
        raise InvalidStateError(f"drive_to: got place and {', '.join(given)}; expected one.")
    if place is None and (x is None or y is None):
        raise InvalidStateError("drive_to: got neither place nor x and y; expected one.")
    where: Any = place if x is None or y is None else Pose2D(x, y, yaw or 0.0)
    return driving(where, action=action, exec_timeout=exec_timeout)


def turn(degrees: float) -> State:
    """Turn on the spot. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        degrees: The angle [deg], anticlockwise.
    """
    from smachpy.states.driving import turn as turning

    return turning(degrees)


def locate(key: str = "here", topic: str = "odom") -> State:
    """Write the robot's pose to a key. Outcomes: 'valid', 'invalid', 'preempted', 'aborted'.

    Args:
        key: The userdata key.
        topic: A topic of nav_msgs/Odometry.
    """
    from smachpy.states.driving import locate as locating

    return locating(key, topic)


def ask(
    question: str,
    answers: Sequence[str] | Mapping[str, str] = ("yes", "no"),
    patience: float = 60.0,
    default: str = "no_answer",
) -> State:
    """Ask a person. Outcomes: the answers, `default`, 'preempted'.

    Args:
        question: The question.
        answers: The possible answers, or answer: text of its button.
        patience: Longest wait [s].
        default: The outcome if nobody answers.
    """
    from smachpy.states.ask_operator import AskOperator

    return AskOperator(question, answers, patience=patience, default=default)


def action(
    name: str,
    type: str,  # noqa: A002  its name in files
    goal: Mapping[str, Any] | None = None,
    goal_key: str | None = None,
    result_key: str | None = None,
    exec_timeout: float | None = None,
    server_wait_timeout: float | None = 60.0,
    cancel_on_client_lost: bool = False,
) -> State:
    """Send a goal to an action server. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        name: Name of the action.
        type: Its type, such as `move_base_msgs/MoveBase`.
        goal: The fields of the goal.
        goal_key: The userdata key of the goal, instead.
        result_key: The userdata key that gets the result.
        exec_timeout: Longest time for the goal [s].
        server_wait_timeout: Longest wait for the server [s].
        cancel_on_client_lost: The server cancels the goal if this program dies.
    """
    from actionlib_core.wire.action_types import ActionTypes
    from smachpy.actions.simple_action_state import SimpleActionState

    if goal is not None and goal_key is not None:
        raise InvalidStateError("action: got goal and goal_key; expected one of them.")
    spec = _interface("action", type)
    kind = ActionTypes.of(spec).goal
    return SimpleActionState(
        name,
        spec,
        goal=None if goal is None else kind.from_dict(goal),
        goal_cb=None if goal is None else lambda *_: kind.from_dict(goal),  # its "now" is then
        goal_key=goal_key,
        result_key=result_key,
        exec_timeout=exec_timeout,
        server_wait_timeout=server_wait_timeout,
        cancel_on_client_lost=cancel_on_client_lost,
    )


def service(
    name: str,
    type: str,  # noqa: A002  its name in files
    request: Mapping[str, Any] | None = None,
    succeeded_if: str = "",
    response_key: str | None = None,
    timeout: float = 10.0,
) -> State:
    """Call a service. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        name: Name of the service.
        type: Its type, such as `std_srvs/Trigger`.
        request: The fields of the request.
        succeeded_if: An expression over the response, such as `success`; "" for any response.
        response_key: The userdata key that gets the response.
        timeout: Longest time for the call [s].
    """
    from smachpy.actions.service_state import ServiceState

    spec = _interface("service", type)
    kind, response = spec._request_class, spec._response_class
    holds = _on_message("succeeded_if", succeeded_if, response) if succeeded_if else None

    def judge(_userdata: UserData, response: Any) -> str:
        return "succeeded" if holds is None or holds(response) else "aborted"

    return ServiceState(
        name,
        spec,
        request=kind.from_dict(request or {}),
        request_cb=lambda *_: kind.from_dict(request or {}),  # its "now" is then
        response_cb=judge,
        response_key=response_key,
        timeout=timeout,
    )


def monitor(topic: str, type: str, valid_while: str, timeout: float | None = None) -> State:  # noqa: A002
    """Watch a topic. Outcomes: 'invalid' (the condition ceased), 'valid', 'aborted', 'preempted'.

    Args:
        topic: Name of the topic.
        type: Its type, such as `sensor_msgs/BatteryState`.
        valid_while: An expression over the message, such as `percentage >= 0.3`.
        timeout: Longest wait [s].
    """
    from smachpy.actions.monitor_state import MonitorState

    kind = _interface("message", type)
    holds = _on_message("valid_while", valid_while, kind)

    def check(_userdata: UserData, message: Any) -> bool:
        return bool(holds(message))

    check.__name__ = valid_while  # shown in pictures
    return MonitorState(topic, kind, check, timeout=timeout)


def await_message(
    topic: str,
    type: str,  # noqa: A002  its name in files
    until: str = "",
    key: str | None = None,
    timeout: float | None = 60.0,
) -> State:
    """Wait for a message. Outcomes: 'came', 'timeout', 'preempted'.

    Args:
        topic: Name of the topic.
        type: Its type.
        until: An expression over the message that must hold; "" for any message.
        key: The userdata key that gets the message.
        timeout: Longest wait [s]; none: no limit.
    """
    from smachpy.states.waiting import AwaitMessage

    kind = _interface("message", type)
    holds = _on_message("until", until, kind) if until else None

    def wanted(message: Any) -> bool:
        return holds is None or bool(holds(message))

    return AwaitMessage(topic, kind, wanted, key=key, timeout=timeout)


def publish(
    topic: str,
    type: str,  # noqa: A002  its name in files
    message: Mapping[str, Any] | None = None,
    key: str | None = None,
    subscribers: int | None = None,
    latch: bool = False,
    timeout: float | None = 5.0,
) -> State:
    """Publish a message once somebody listens. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        topic: Name of the topic.
        type: Its type, such as `std_msgs/Bool`.
        message: The fields of the message; a header may be `auto`.
        key: The userdata key of the message or its fields, instead.
        subscribers: How many subscribers to wait for, 1 unless given; 0: none.
        latch: Keep the message for later subscribers, and wait for none.
        timeout: Longest wait for them [s]; none: no limit.
    """
    from smachpy.states.topics import Publish

    if latch and subscribers:
        raise InvalidStateError(
            f"publish: got latch and subscribers: {subscribers}; expected one of them."
        )
    return Publish(
        topic,
        _interface("message", type),
        message,
        key=key,
        subscribers=1 if subscribers is None else subscribers,
        latch=latch,
        timeout=timeout,
    )


def record_bag(
    path: str,
    topics: Mapping[str, str],
    seconds: float | None = None,
    key: str | None = None,
) -> State:
    """Record topics to a bag. Outcomes: 'done', 'aborted', 'preempted'.

    Args:
        path: The file, ending in `.mcap`, in the folder in which the mission runs, or below.
        topics: Topic: type of its messages.
        seconds: How long to record [s]; without it until the state is preempted.
        key: The userdata key that gets the path of the file.
    """
    from pathlib import PurePath

    from smachpy.states.bags import RecordBag

    # A mission file may be a stranger's: it chooses no place of the computer.
    where = PurePath(str(path))
    if where.is_absolute() or ".." in where.parts:
        raise InvalidStateError(
            f"record_bag: path: got {path!r}; expected a path below the working folder."
        )
    kinds = {topic: _interface("message", type_) for topic, type_ in topics.items()}
    return RecordBag(path, kinds, seconds=seconds, key=key)


def look_up_transform(
    key: str, frame: str, into: str = "map", tf: str = "tf", timeout: float | None = 5.0
) -> State:
    """Write the pose of a frame to a key. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        key: The userdata key that gets it, a `geometry_msgs/PoseStamped`.
        frame: The frame to look for, such as `base_link`.
        into: The frame of the result.
        tf: The topic of the transforms; `/tf` is always read, too.
        timeout: Longest wait [s]; none: no limit.
    """
    from smachpy.states.topics import LookUpTransform

    return LookUpTransform(key, frame, into, tf=tf, timeout=timeout)


def clear_costmaps(
    navigation: Literal["nav2", "move_base"] = "nav2",
    namespace: str = "",
    timeout: float | None = 10.0,
) -> State:
    """Let the navigation forget all obstacles. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        navigation: nav2 or, for ROS 1, move_base.
        namespace: Prefix of its names, such as `robot_0`.
        timeout: Longest time for each call [s]; none: no limit.
    """
    from smachpy.states.nav2 import clear_costmaps as clearing

    return clearing(navigation=navigation, namespace=namespace, timeout=timeout)


def dock(
    id: str = "",  # noqa: A002  its name in files
    place: str | None = None,
    dock_type: str = "",
    navigate: bool = True,
    action: str = "dock_robot",
    exec_timeout: float | None = 300.0,
) -> State:
    """Dock by Nav2. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        id: The dock's name in the robot's database; or give place.
        place: The userdata key of the dock's pose.
        dock_type: The plugin for that dock.
        navigate: Drive to the staging pose in front of the dock first.
        action: Name of the action.
        exec_timeout: Longest time [s]; none: no limit.
    """
    from smachpy.states.nav2 import dock as docking

    return docking(
        id,
        place=place,
        dock_type=dock_type,
        navigate=navigate,
        action=action,
        exec_timeout=exec_timeout,
    )


def undock(
    dock_type: str = "", action: str = "undock_robot", exec_timeout: float | None = 60.0
) -> State:
    """Undock by Nav2. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        dock_type: The plugin for the dock; "" for that of the dock where it has docked.
        action: Name of the action.
        exec_timeout: Longest time [s]; none: no limit.
    """
    from smachpy.states.nav2 import undock as undocking

    return undocking(dock_type, action=action, exec_timeout=exec_timeout)


def follow_waypoints(
    places: Sequence[Mapping[str, float]] | str,
    loops: int = 0,
    missed_key: str | None = None,
    action: str = "follow_waypoints",
    exec_timeout: float | None = None,
) -> State:
    """Drive through places by Nav2. Outcomes: 'succeeded', 'missed', 'aborted', 'preempted'.

    Args:
        places: The places, each with x, y [m] and yaw [rad] in the map frame; or the userdata key
            of a list of poses.
        loops: How often to go round again.
        missed_key: The userdata key that gets the indices of the places that were missed.
        action: Name of the action.
        exec_timeout: Longest time [s]; none: no limit.
    """
    from smachpy.places.pose import Pose2D
    from smachpy.states.nav2 import follow_waypoints as following

    where: Any = places
    if not isinstance(places, str):
        try:
            where = [Pose2D(**{"yaw": 0.0, **each}) for each in places]
        except TypeError as error:
            raise InvalidStateError(
                f"follow_waypoints: places: got {places!r}; expected a list of x, y and yaw."
            ) from error
    return following(
        where, loops=loops, missed_key=missed_key, action=action, exec_timeout=exec_timeout
    )


def barrier(name: str, parties: int = 2) -> State:
    """Wait for other branches of a concurrence. Outcomes: 'done', 'aborted', 'preempted'.

    Args:
        name: Name of the barrier.
        parties: How many branches must come to it.
    """
    from smachpy.states.barrier import Barrier

    return Barrier(name, parties)


def nav2_active(
    manager: str = "lifecycle_manager_navigation", timeout: float | None = 60.0
) -> State:
    """Wait until Nav2 is active. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        manager: Name of its lifecycle manager's node.
        timeout: Longest wait [s]; none: no limit.
    """
    from smachpy.states.nav2 import nav2_active as active

    return active(manager=manager, timeout=timeout)


def set_parameters(
    node: str,
    values: Mapping[str, Any],
    before: str = "parameters_before",
    ros1: bool = False,
    timeout: float | None = 10.0,
) -> State:
    """Set parameters of a node. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        node: Name of the node.
        values: Name of the parameter: value.
        before: The userdata key that gets what they were; see `restore_parameters`.
        ros1: The node is one of ROS 1, and has dynamic_reconfigure.
        timeout: Longest time [s]; none: no limit.
    """
    from smachpy.states.ros2_nodes import SetParameters

    return SetParameters(node, values, before=before, ros1=ros1, timeout=timeout)


def restore_parameters(before: str = "parameters_before", timeout: float | None = 10.0) -> State:
    """Set back what `set_parameters` has set. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        before: The userdata key that `set_parameters` has written.
        timeout: Longest time for each node [s]; none: no limit.
    """
    from smachpy.states.ros2_nodes import RestoreParameters

    return RestoreParameters(before=before, timeout=timeout)


def set_lifecycle(node: str, state: str = "active", timeout: float | None = 60.0) -> State:
    """Bring a managed ROS 2 node to a state. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        node: Name of the node.
        state: unconfigured, inactive, active or finalized.
        timeout: Longest time [s]; none: no limit.
    """
    from smachpy.states.ros2_nodes import SetLifecycle

    return SetLifecycle(node, state, timeout=timeout)


def _on_message(argument: str, text: str, kind: Any) -> Expression:
    """Return an expression over messages of a class.

    Raises:
        ExpressionError: it cannot be parsed.
        InvalidStateError: it names a field that they do not have.
    """
    from actionlib_core.inputs.expression import WHOLE, Expression

    made, known = Expression(text), list(kind.__slots__)
    problems = Problems("")
    for name in sorted(made.names - {*known, WHOLE}):
        problems.add(unknown_name(f"{argument}: field", name, known))
    problems.raise_all()
    return made


def _interface(kind: str, name: str) -> Any:
    """Return a class of messages, services or actions: of ROS 1 or, if it has none, of ROS 2.

    A name as ROS 2 writes it, `std_srvs/srv/Trigger`, is ROS 2's first. Installed packages are
    asked for theirs (entry points `smachpy.interfaces`) if nobody else has it.
    """
    from actionlib_core import interfaces
    from actionlib_core.exceptions import InterfaceError
    from actionlib_core.interfaces import ros2

    first, second = (ros2, interfaces) if name.count("/") > 1 else (interfaces, ros2)
    try:
        return getattr(first, f"get_{kind}")(name)
    except InterfaceError:
        with contextlib.suppress(InterfaceError):
            return getattr(second, f"get_{kind}")(name)
        from importlib.metadata import entry_points

        for point in entry_points(group="smachpy.interfaces"):
            point.load()
        return getattr(first, f"get_{kind}")(name)


BY_NAME: Final[dict[str, Callable[..., State]]] = {
    "action": action,
    "ask": ask,
    "await_message": await_message,
    "barrier": barrier,
    "clear_costmaps": clear_costmaps,
    "compute": compute,
    "dock": dock,
    "drive_to": drive_to,
    "follow_waypoints": follow_waypoints,
    "locate": locate,
    "look_up_transform": look_up_transform,
    "monitor": monitor,
    "nav2_active": nav2_active,
    "publish": publish,
    "record_bag": record_bag,
    "restore_parameters": restore_parameters,
    "service": service,
    "set": set_keys,
    "set_lifecycle": set_lifecycle,
    "set_parameters": set_parameters,
    "turn": turn,
    "undock": undock,
    "wait": wait,
}
"""Name in files -> function that makes the state."""
