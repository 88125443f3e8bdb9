"""A node of a robot: its parameters and, for managed nodes of ROS 2, its life cycle.

Every ROS 2 node offers services for its parameters, such as `<node>/get_parameters`. A managed node
also offers `<node>/get_state` and `<node>/change_state`. Nav2 consists of managed nodes. A node of
ROS 1 whose parameters can change while it runs offers `<node>/set_parameters` of
dynamic_reconfigure.

Source:
    rcl_interfaces and lifecycle_msgs; https://design.ros2.org/articles/node_lifecycle.html.
    https://wiki.ros.org/dynamic_reconfigure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import RemoteNodeError
from actionlib_core.inputs.arguments import check_limit
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    DoubleParameter,
    IntParameter,
    StrParameter,
)
from actionlib_core.interfaces.dynamic_reconfigure.srv import Reconfigure
from actionlib_core.node import get_node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from actionlib_core.wire.ros2.network import choose_network

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from typing import TypeAlias

    from actionlib_core.node import Node
    from actionlib_core.time import Duration

    Value: TypeAlias = (
        bool | int | float | str | bytes | list[bool] | list[int] | list[float] | list[str]
    )

TIMEOUT_S = 10.0  # default limit of a call
MAX_INTEGER = 2**63  # integer parameters have 64 bits
MAX_ROS1_INTEGER = 2**31  # and 32 in ROS 1

_FIELDS = {
    1: "bool_value",
    2: "integer_value",
    3: "double_value",
    4: "string_value",
    5: "byte_array_value",
    6: "bool_array_value",
    7: "integer_array_value",
    8: "double_array_value",
    9: "string_array_value",
}
"""The field of a ParameterValue that holds its value, by its `type` (ParameterType)."""
_NUMBERS = {field: number for number, field in _FIELDS.items()}
_ARRAYS = frozenset(number for number, field in _FIELDS.items() if field.endswith("array_value"))
_PARTS: Any = {bool: BoolParameter, int: IntParameter, float: DoubleParameter, str: StrParameter}


class _ServicesOfNode:
    """Calls the services of one node."""

    def __init__(
        self, name: str, *, timeout: float | Duration | None = TIMEOUT_S, node: Node | None = None
    ) -> None:
        self._node = node if node is not None else get_node()
        self.name = self._node.resolve(name, "node name")
        self.timeout = check_limit(f"node {name!r}", "timeout", timeout)
        self._closed = False
        self._calls: set[ServiceProxy[..., Any, Any]] = set()  # those that run; `set` is atomic

    def close(self) -> None:
        """Make running and later calls fail with a `NodeError`; a second call does nothing."""
        self._closed = True
        for proxy in list(self._calls):
            proxy.close()

    def _use_service(self, service: str, service_class: Any, use: Callable[[Any], Any]) -> Any:
        """Use a proxy of one of its services, which `close` closes."""
        proxy: Any = ServiceProxy(
            f"/{self.name}/{service}", service_class, timeout=self.timeout, node=self._node
        )
        self._calls.add(proxy)
        try:
            if self._closed:  # also by a `close` that has not seen this proxy
                proxy.close()
            return use(proxy)
        finally:
            self._calls.discard(proxy)


class RemoteNode(_ServicesOfNode):
    """Calls the parameter and life-cycle services of a ROS 2 node.

    Args:
        name: The node's name, `controller_server` for example.
        timeout: Longest time of a call [s], including the wait for the node to appear; None: no
            limit.
        node: Our node; None: the current node.

    Attributes:
        name: The full name, without a slash in front.
        timeout: See above; it may be changed between calls.

    Raises:
        InvalidDurationError: `timeout` is not a duration, or negative.
        InvalidNameError: the name breaks the ROS rules.
        ConfigError: several ROS 2 networks are configured, and the name is on none of them.

    Every method blocks until the node has answered, `timeout` at most, and raises the errors of
    `ServiceProxy.call` when it does not answer.

    Threads: any number of threads may call at the same time.
    """

    def __init__(
        self, name: str, *, timeout: float | Duration | None = TIMEOUT_S, node: Node | None = None
    ) -> None:
        super().__init__(name, timeout=timeout, node=node)
        # The services' types are those of the robot's distribution.
        self._distro = choose_network(self._node.config.ros2, self.name).distro

    def wait(self, timeout: float | Duration | None = None, *, managed: bool = False) -> None:
        """Wait until the node is there.

        Args:
            timeout: Longest wait [s]; None: no limit.
            managed: Wait for its life cycle rather than for its parameters.

        Raises:
            WaitTimeoutError: it was not there in time.
        """
        what = "get_state", "lifecycle_msgs/GetState"
        self._use(
            *(what if managed else ("get_parameters", "rcl_interfaces/GetParameters")),
            lambda proxy: proxy.wait_for_service(timeout),
        )

    def get_parameters(self, *names: str) -> dict[str, Any]:
        """Return the values of parameters by name.

        Raises:
            RemoteNodeError: the node does not have some of them; the error names all of those.
        """
        values = self._values(names)
        # If one of them is undeclared, rclcpp answers with an empty list: ask one by one.
        if len(values) != len(names):
            values = [(self._values((name,)) or [None])[0] for name in names]
        found = dict(zip(names, values, strict=True))
        missing = {
            name: "got no such parameter; expected one that is declared and set"
            for name, value in found.items()
            if value is None
        }
        if missing:
            raise RemoteNodeError(self.name, missing)
        return found

    def _values(self, names: tuple[str, ...]) -> list[Any]:
        return [value_of(message) for message in self._messages(names)]

    def _messages(self, names: Iterable[str]) -> list[Any]:
        """Return the ParameterValues; an empty list if one of them is undeclared."""
        response = self._call("get_parameters", "rcl_interfaces/GetParameters", names=list(names))
        return list(response.values)

    def set_parameters(self, values: Mapping[str, Value]) -> None:
        """Set parameters by name; an empty list is of the type that the parameter has.

        Raises:
            RemoteNodeError: some values are not possible for a parameter, and nothing was sent; or
                the node refused some values and has set the others. The error names all of those.
        """
        make: Any = ros2.get_message("rcl_interfaces/ParameterValue", self._distro)
        make_parameter: Any = ros2.get_message("rcl_interfaces/Parameter", self._distro)
        parameters, problems = [], {}
        empty = [name for name, value in values.items() if isinstance(value, list) and not value]
        now = self._messages(empty) if empty else []
        arrays = {
            name: make(type=message.type)
            for name, message in zip(empty, now, strict=False)
            if message.type in _ARRAYS
        }
        for name, value in values.items():
            try:
                message = arrays.get(name) or parameter_value(value, make)
                parameters.append(make_parameter(name=name, value=message))
            except ValueError as error:
                problems[name] = str(error)
        if problems:
            raise RemoteNodeError(self.name, problems)
        response = self._call(
            "set_parameters", "rcl_interfaces/SetParameters", parameters=parameters
        )
        refused = {
            name: result.reason or "the node refused it without a reason"
            for name, result in zip(values, response.results, strict=False)
            if not result.successful
        }
        # Fewer results than parameters: the node has not answered for the rest.
        refused |= dict.fromkeys(list(values)[len(response.results) :], "got no answer")
        if refused:
            raise RemoteNodeError(self.name, refused)

    def list_parameters(self, *prefixes: str) -> list[str]:
        """Return the names of its parameters, sorted; with prefixes, only those below them."""
        response = self._call(
            "list_parameters", "rcl_interfaces/ListParameters", prefixes=list(prefixes), depth=0
        )
        return sorted(response.result.names)

    def state(self) -> str:
        """Return the state of a managed node: "unconfigured", "inactive", "active", "finalized"."""
        state = self._call("get_state", "lifecycle_msgs/GetState").current_state
        return str(state.label)

    def change_state(self, transition: str) -> None:
        """Request a transition of a managed node, and wait until it has ended.

        Args:
            transition: "configure", "activate", "deactivate", "cleanup" or "shutdown".

        Raises:
            RemoteNodeError: the node is in another state, or its transition failed.
        """
        change_state: Any = ros2.get_service("lifecycle_msgs/ChangeState", self._distro)
        request = change_state.Request()
        request.transition.label = transition
        request.transition.id = getattr(
            type(request.transition), f"TRANSITION_{transition.upper()}", 0
        )
        # An unknown label with id 0 is sent too: the node decides which transitions it has.
        if not self._call("change_state", "lifecycle_msgs/ChangeState", request).success:
            why = f"got a refusal in state '{self.state()}'; expected a transition from there"
            raise RemoteNodeError(self.name, {transition: why})

    def _call(self, service: str, type_name: str, *args: Any, **fields: Any) -> Any:
        return self._use(service, type_name, lambda proxy: proxy.call(*args, **fields))

    def _use(self, service: str, type_name: str, use: Callable[[Any], Any]) -> Any:
        return self._use_service(service, ros2.get_service(type_name, self._distro), use)


class ReconfiguredNode(_ServicesOfNode):
    """Changes the parameters of a ROS 1 node while it runs, by dynamic_reconfigure.

    `move_base` has them in parts, such as the node name `move_base/DWAPlannerROS`. Arguments,
    attributes, errors, blocking and threads are those of `RemoteNode`.
    """

    def wait(self, timeout: float | Duration | None = None) -> None:
        """Wait until the node is there.

        Args:
            timeout: Longest wait [s]; None: no limit.

        Raises:
            WaitTimeoutError: it was not there in time.
        """
        self._use_service(
            "set_parameters", Reconfigure, lambda proxy: proxy.wait_for_service(timeout)
        )

    def get_parameters(self, *names: str) -> dict[str, Any]:
        """Return the values of parameters by name.

        Raises:
            RemoteNodeError: the node does not have some of them; the error names all of those.
        """
        found = self._request(Config())
        missing = {
            name: f"got no such parameter; expected one of its own.{did_you_mean(name, found)}"
            for name in names
            if name not in found
        }
        if missing:
            raise RemoteNodeError(self.name, missing)
        return {name: found[name] for name in names}

    def set_parameters(self, values: Mapping[str, bool | float | str]) -> None:
        """Set parameters by name.

        Raises:
            RemoteNodeError: some values are not possible for a parameter, and nothing was sent; or
                the node has others now, as it limits them, and has set the rest. The error names
                all of those.
        """
        problems, config, others = {}, Config(), {}
        for name, value in values.items():
            try:
                add_to_config(config, name, value)
            except ValueError as error:
                problems[name] = str(error)
        if not problems:
            now = self._request(config)
            for name, value in values.items():
                if now.get(name) != value:
                    if name in now:
                        others[name] = now[name]
                    # Texts are not shown: one may be a password.
                    shown = "" if isinstance(value, str) else f": {now.get(name)!r}, not {value!r}"
                    problems[name] = (
                        f"the node did not take the value{shown}. Try one of its type and within "
                        "its limits."
                    )
        if problems:
            raise RemoteNodeError(self.name, problems, others)

    def _request(self, config: Config) -> dict[str, Any]:
        """Set some parameters, or none; return the values of all."""
        now = self._use_service(
            "set_parameters", Reconfigure, lambda proxy: proxy.call(config)
        ).config
        return {one.name: one.value for one in (*now.bools, *now.ints, *now.strs, *now.doubles)}


def add_to_config(config: Config, name: str, value: Any) -> None:
    """Add a parameter to a configuration of dynamic_reconfigure.

    Raises:
        ValueError: a parameter of ROS 1 cannot have this value.
    """
    places = ((bool, config.bools), (int, config.ints), (float, config.doubles), (str, config.strs))
    too_big = type(value) is int and not -MAX_ROS1_INTEGER <= value < MAX_ROS1_INTEGER
    for kind, place in places:  # bool before int, of which it is a subclass
        if isinstance(value, kind) and not too_big:
            config_part: Any = _PARTS[kind](name=name, value=value)
            place.append(config_part)
            return
    raise ValueError(f"got {value!r}; expected a bool, an int of 32 bits, a float or a str.")


def value_of(message: Any) -> Any:
    """Return the value in a ParameterValue; None when it is not set, or of an unknown type."""
    field = _FIELDS.get(message.type)
    if field is None:
        return None
    value = getattr(message, field)
    if field == "byte_array_value":
        return bytes(value)
    return list(value) if field.endswith("array_value") else value


def parameter_value(value: Any, make: Callable[[], Any]) -> Any:
    """Return a ParameterValue.

    Args:
        value: A bool, int, float, str, bytes, or a list of one of them; ints and floats may be
            mixed.
        make: Makes an empty ParameterValue.

    Raises:
        ValueError: a parameter cannot have this value.
    """
    message = make()
    field = _field_of(value)
    message.type = _NUMBERS[field]
    if field == "double_array_value":
        value = [float(item) for item in value]
    setattr(message, field, value)
    return message


def _field_of(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        inner = {_field_of(item) for item in value}
        if inner == {"integer_value", "double_value"}:
            inner = {"double_value"}
        simple = {f"{word}_value" for word in ("bool", "integer", "double", "string")}
        if len(inner) == 1 and inner <= simple:
            return inner.pop().replace("_value", "_array_value")
    too_big = type(value) is int and not -MAX_INTEGER <= value < MAX_INTEGER
    # bool before int, of which it is a subclass.
    kinds = ((bool, "bool"), (int, "integer"), (float, "double"), (str, "string"))
    for kind, word in (*kinds, (bytes, "byte_array"), (bytearray, "byte_array")):
        if isinstance(value, kind) and not too_big:
            return f"{word}_value"
    raise ValueError(
        f"got {value!r}; expected a bool, an int of 64 bits, a float, a str, bytes, or a list of "
        "values of one such type that is not empty."
    )
