"""Scripted nodes: the parameters of a node and, in ROS 2, its life cycle."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.dynamic_reconfigure.srv import Reconfigure
from actionlib_core.pubsub.remote_node import add_to_config, parameter_value, value_of
from actionlib_core.pubsub.service import Service
from smachpy.testing.servers import ScriptedEnd, Test

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping
    from typing import Self

SERVICES: Final = {
    "get_parameters": "rcl_interfaces/GetParameters",
    "set_parameters": "rcl_interfaces/SetParameters",
    "list_parameters": "rcl_interfaces/ListParameters",
    "get_state": "lifecycle_msgs/GetState",
    "change_state": "lifecycle_msgs/ChangeState",
}
STRING_ARRAY: Final = 9  # of rcl_interfaces/ParameterType
MOVES: Final = {
    ("unconfigured", "configure"): "inactive",
    ("inactive", "activate"): "active",
    ("active", "deactivate"): "inactive",
    ("inactive", "cleanup"): "unconfigured",
    ("unconfigured", "shutdown"): "finalized",
    ("inactive", "shutdown"): "finalized",
    ("active", "shutdown"): "finalized",
}


class ScriptedNode(ScriptedEnd):
    """A ROS 2 node with parameters and, if it is managed, a life cycle; answers as rclcpp does.

    Made by `mission.ros2_node`. `kill()` and `come_back()` restart it: it has its first parameters
    and its first state again.

    Args:
        kit: The test.
        name: The node's name.
        parameters: Its parameters with their first values.
        state: Its first state, "unconfigured" for example; "" for a node without a life cycle.

    Attributes:
        parameters: The parameters now; the test may change them.
        state: Its state now; the test may change it.
        changes: What was set, in order: one dict for each request that changed something.
        transitions: The transitions that were requested and happened, in order.
        refused: Name of a parameter or transition -> reason for which it is refused.
        highest: Name of a parameter -> its limit, of a ROS 1 node.
        takes: How long each answer takes, by the name of the service [s]; None: it never comes. A
            node answers one request after another.
    """

    def __init__(
        self, kit: Test, name: str, parameters: Mapping[str, Any] | None = None, state: str = ""
    ) -> None:
        self._first = copy.deepcopy(dict(parameters or {})), state
        self.changes: list[dict[str, Any]] = []
        self.transitions: list[str] = []
        self.refused: dict[str, str] = {}
        self.highest: dict[str, float] = {}
        self.takes: dict[str, float | None] = {}
        super().__init__(kit, name, None)

    def _start(self) -> None:
        parameters, self.state = self._first
        self.parameters = copy.deepcopy(parameters)
        self._free_at = 0.0  # when it is through with all requests so far [s]
        for service, (kind, answer) in self._services().items():

            def handle(
                request: Any, service: str = service, answer: Any = answer, kind: Any = kind
            ) -> Any:
                seconds = self.takes.get(service, 0.0)
                if seconds is None:
                    self._clock.event(f"the end of the test of {self.name}").wait()
                    return kind._response_class()
                # One request after another, as a node with one thread.
                self._free_at = max(self._free_at, self._clock.now()) + seconds
                self._clock.sleep(self._free_at - self._clock.now())
                return answer(request, kind._response_class())

            Service(f"/{self.name.strip('/')}/{service}", kind, handle, node=self.node)

    def _services(self) -> dict[str, tuple[Any, Any]]:
        """Return its services: name -> class, and the function that answers."""
        answers = {
            "get_parameters": self._get,
            "set_parameters": self._set,
            "list_parameters": self._list,
        }
        if self.state:
            answers |= {"get_state": self._get_state, "change_state": self._change_state}
        return {name: (ros2.get_service(SERVICES[name]), each) for name, each in answers.items()}

    def copy_to(self, kit: Test) -> Self:
        """Make the same node in another test, with its parameters and its state now."""
        made = type(self)(kit, self.name, *self._first)
        made.parameters, made.state = copy.deepcopy(self.parameters), self.state
        made.refused, made.takes = dict(self.refused), dict(self.takes)
        made.highest = dict(self.highest)
        return made

    def situation(self) -> Hashable:
        """Return its parameters and its state."""
        return repr(sorted(self.parameters.items())), self.state

    # -- the node's side -----------------------------------------------------------------------

    def _get(self, request: Any, response: Any) -> Any:
        make: Any = ros2.get_message("rcl_interfaces/ParameterValue")
        if set(request.names) <= set(self.parameters):  # as rclcpp: otherwise an empty list
            response.values = [_message(self.parameters[name], make) for name in request.names]
        return response

    def _set(self, request: Any, response: Any) -> Any:
        result: Any = ros2.get_message("rcl_interfaces/SetParametersResult")
        make: Any = ros2.get_message("rcl_interfaces/ParameterValue")
        results, changed = [], {}
        for parameter in request.parameters:
            name, value = parameter.name, value_of(parameter.value)
            reason = self.refused.get(name, "")
            if name not in self.parameters:
                reason = f"parameter '{name}' cannot be set because it was not declared"
            else:
                old = _type_of(_message(self.parameters[name], make))
                new = _type_of(parameter.value)
                if not (old.startswith(new) or new.startswith(old)):  # "list" has nothing in it
                    reason = (
                        f"Wrong parameter type, parameter {{{name}}} is of type {{{old}}}, setting "
                        f"it to {{{new}}} is not allowed."
                    )
            if not reason:
                changed[name] = self.parameters[name] = value
            results.append(result(successful=not reason, reason=reason))
        if changed:
            self.changes.append(changed)
        response.results = results
        return response

    def _list(self, request: Any, response: Any) -> Any:
        response.result.names = [
            name
            for name in self.parameters
            if not request.prefixes or name.startswith(tuple(request.prefixes))
        ]
        return response

    def _get_state(self, request: Any, response: Any) -> Any:
        del request
        response.current_state.label = self.state
        return response

    def _change_state(self, request: Any, response: Any) -> Any:
        label = request.transition.label
        after = "" if label in self.refused else MOVES.get((self.state, label), "")
        response.success = bool(after)
        if after:
            self.transitions.append(label)
            self.state = after
        return response


class ScriptedRos1Node(ScriptedNode):
    """A ROS 1 node with parameters of dynamic_reconfigure; it answers as ROS 1's own server does.

    It ignores parameters that it does not have, and values of another type. Made by
    `mission.ros1_node`; it has what `ScriptedNode` has, without a life cycle. What is `refused`
    keeps its value, and the reason is told to nobody; what is beyond its `highest` becomes that.
    """

    def _services(self) -> dict[str, tuple[Any, Any]]:
        return {"set_parameters": (Reconfigure, self._reconfigure)}

    def _reconfigure(self, request: Any, response: Any) -> Any:
        config = request.config
        changed = {
            part.name: min(part.value, self.highest.get(part.name, part.value))  # type: ignore[type-var]
            for part in (*config.bools, *config.ints, *config.strs, *config.doubles)
            if type(self.parameters.get(part.name)) is type(part.value)
            and part.name not in self.refused
        }
        if changed:
            self.parameters |= changed
            self.changes.append(changed)
        for name, value in self.parameters.items():
            add_to_config(response.config, name, value)
        return response


def _message(value: Any, make: Any) -> Any:
    """Return the ParameterValue of a value; an empty list is one of texts."""
    return make(type=STRING_ARRAY) if value == [] else parameter_value(value, make)


def _type_of(message: Any) -> str:
    """Return the type of a ParameterValue for a text: "float", "list of int", "list" if empty."""
    value = value_of(message)
    inner = f" of {type(value[0]).__name__}" if isinstance(value, list) and value else ""
    return f"{type(value).__name__}{inner}"
