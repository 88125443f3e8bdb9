"""The ready-made states by their names in mission files: their arguments are plain data.

Other packages register theirs as entry points `smachpy.states`: a function of keyword arguments
that returns a state, with `Args:` in its docstring.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from smachpy.exceptions import InvalidStateError
from smachpy.machines.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

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
            userdata[key] = value
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
    yaw: float = 0.0,
    action: str = "move_base",
    exec_timeout: float = 600.0,
) -> State:
    """Drive to a place. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        place: The userdata key of a pose; or give x and y.
        x: Position in the map frame [m].
        y: Position in the map frame [m].
        yaw: Heading there [rad].
        action: Name of the action.
        exec_timeout: Longest drive [s].
    """
    from smachpy.places.pose import Pose2D
    from smachpy.states.driving import drive_to as driving

    if (place is None) == (x is None or y is None):
        raise InvalidStateError("drive_to: got both or none of place and x, y; expected one.")
    where: Any = place if x is None or y is None else Pose2D(x, y, yaw)
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
    """
    from actionlib_core.interfaces import get_action
    from smachpy.actions.simple_action_state import SimpleActionState

    spec: Any = get_action(type)
    made = None if goal is None else _class_of(spec().action_goal.goal).from_dict(goal)
    return SimpleActionState(
        name,
        spec,
        goal=made,
        goal_key=goal_key,
        result_key=result_key,
        exec_timeout=exec_timeout,
        server_wait_timeout=server_wait_timeout,
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
    from actionlib_core.inputs.expression import Expression
    from actionlib_core.interfaces import get_service
    from smachpy.actions.service_state import ServiceState

    spec: Any = get_service(type)
    made = spec._request_class.from_dict(request or {})
    holds = Expression(succeeded_if) if succeeded_if else None

    def judge(_userdata: UserData, response: Any) -> str:
        return "succeeded" if holds is None or holds(response) else "aborted"

    return ServiceState(
        name, spec, request=made, response_cb=judge, response_key=response_key, timeout=timeout
    )


def monitor(topic: str, type: str, valid_while: str, timeout: float | None = None) -> State:  # noqa: A002
    """Watch a topic. Outcomes: 'invalid' (the condition ceased), 'valid', 'aborted', 'preempted'.

    Args:
        topic: Name of the topic.
        type: Its type, such as `sensor_msgs/BatteryState`.
        valid_while: An expression over the message, such as `percentage >= 0.3`.
        timeout: Longest wait [s].
    """
    from actionlib_core.inputs.expression import Expression
    from actionlib_core.interfaces import get_message
    from smachpy.actions.monitor_state import MonitorState

    holds = Expression(valid_while)

    def check(_userdata: UserData, message: Any) -> bool:
        return bool(holds(message))

    return MonitorState(topic, get_message(type), check, timeout=timeout)


def await_message(topic: str, type: str, until: str = "True", timeout: float = 60.0) -> State:  # noqa: A002
    """Wait for a message. Outcomes: 'came', 'timeout', 'preempted'.

    Args:
        topic: Name of the topic.
        type: Its type.
        until: An expression over the message that must hold.
        timeout: Longest wait [s].
    """
    from actionlib_core.inputs.expression import Expression
    from actionlib_core.interfaces import get_message
    from smachpy.states.waiting import AwaitMessage

    holds = Expression(until)
    return AwaitMessage(
        topic, get_message(type), lambda message: bool(holds(message)), timeout=timeout
    )


def nav2_active(manager: str = "lifecycle_manager_navigation", timeout: float = 60.0) -> State:
    """Wait until Nav2 is active. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        manager: Name of its lifecycle manager's node.
        timeout: Longest wait [s].
    """
    from smachpy.states.nav2 import nav2_active as active

    return active(manager=manager, timeout=timeout)


def set_parameters(
    node: str,
    values: Mapping[str, Any],
    before: str = "parameters_before",
    timeout: float | None = 10.0,
) -> State:
    """Set parameters of a ROS 2 node. Outcomes: 'succeeded', 'aborted', 'preempted'.

    Args:
        node: Name of the node.
        values: Name of the parameter: value.
        before: The userdata key that gets what they were; see `restore_parameters`.
        timeout: Longest time [s]; none: no limit.
    """
    from smachpy.states.ros2_nodes import SetParameters

    return SetParameters(node, values, before=before, timeout=timeout)


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


def _class_of(message: Any) -> Any:
    return message.__class__


BY_NAME: Final[dict[str, Callable[..., State]]] = {
    "action": action,
    "ask": ask,
    "await_message": await_message,
    "compute": compute,
    "drive_to": drive_to,
    "locate": locate,
    "monitor": monitor,
    "nav2_active": nav2_active,
    "restore_parameters": restore_parameters,
    "service": service,
    "set": set_keys,
    "set_lifecycle": set_lifecycle,
    "set_parameters": set_parameters,
    "turn": turn,
    "wait": wait,
}
"""Name in files -> function that makes the state."""
