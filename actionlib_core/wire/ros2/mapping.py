"""Maps a name of this program to ROS 2: its name and type there, and conversions of its messages.

Names with a ROS 2 class are on ROS 2 without further settings. Names with a ROS 1 class are where
the configuration says so: the names in `ros2.names`, those of a `ros2.robot`, and those in
`ros2.map`. The ROS 2 type is the one in `map`, else a successor that is known here (move_base
becomes navigate_to_pose), else the type of the same name.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from actionlib_core.config import ALL_NAMES
from actionlib_core.exceptions import ConfigError, CorrespondenceError, InterfaceError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces._correspondence import converter
from actionlib_core.interfaces._ros2 import ros2_registry
from actionlib_core.wire.ros2.network import choose_network, is_named

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.config import Mapped, Ros2
    from actionlib_core.interfaces._sources import Kind
    from actionlib_core.node import Node
    from actionlib_core.wire.action_types import ActionTypes

    Convert = Callable[[Any], Any]

_PACKAGES_OF_PROGRAMS = frozenset({"std_msgs", "std_srvs"})
"""Not taken to a robot by `ALL_NAMES`: missions use them among themselves."""
KNOWN_ACTIONS = {
    "move_base_msgs/MoveBase": ("move_base", "navigate_to_pose", "nav2_msgs/NavigateToPose"),
}
"""ROS 1 actions with successors: their usual name, the name on ROS 2, the type on ROS 2."""


@dataclass(frozen=True, slots=True)
class ActionOnRos2:
    """An action as it is on ROS 2.

    Attributes:
        name: Full name on ROS 2, still without the network's namespace.
        action: Its ROS 2 class.
        to_goal: Converts a goal of this program to ROS 2.
        from_goal: The opposite direction, for servers.
        to_result: As `to_goal`.
        from_result: As `from_goal`, for clients.
        to_feedback: As `to_goal`.
        from_feedback: As `from_goal`, for clients.
    """

    name: str
    action: type[ros2.Ros2Action]
    to_goal: Convert
    from_goal: Convert
    to_result: Convert
    from_result: Convert
    to_feedback: Convert
    from_feedback: Convert


@dataclass(frozen=True, slots=True)
class MessageOnRos2:
    """A topic, or one direction of a service, as it is on ROS 2.

    Attributes:
        name: As in `ActionOnRos2`.
        message: Its ROS 2 class.
        to_ros2: Converts a message of this program to that class.
        from_ros2: The opposite direction.
    """

    name: str
    message: Any
    to_ros2: Convert
    from_ros2: Convert


def find_network(node: Node, name: str, cls: Any) -> Ros2 | None:
    """Return the ROS 2 network of a full name; None when the name is on our own wire.

    Args:
        node: Its configuration is used.
        name: Of an action, topic or service.
        cls: Its class.

    Raises:
        ConfigError: the class is one of ROS 2, and the name is on no network.
    """
    networks = node.config.ros2
    if getattr(cls, "_wire", "ros1") == "ros2":
        return choose_network(networks, name)
    if not any(is_named(network, name) for network in networks):
        return None
    network = choose_network(networks, name)
    # When only `ALL_NAMES` matches, the name was not chosen by itself: its type decides.
    others = tuple(pattern for pattern in network.names if pattern != ALL_NAMES)
    if others != network.names and not is_named(replace(network, names=others), name):
        return network if _is_of_robots(network, cls) else None
    return network


def _is_of_robots(network: Ros2, cls: Any) -> bool:
    """Return whether `ALL_NAMES` applies to a type: ROS 2 has it, and robots use it."""
    if not hasattr(cls, "_type"):  # a class that only looks like an action, made by a program
        return False
    if cls._type in {f"{known}Action" for known in KNOWN_ACTIONS}:
        return True
    found = ros2_registry(network.distro)
    package, _, short = cls._type.partition("/")
    if package in _PACKAGES_OF_PROGRAMS:
        return False
    kinds = {"srv": short, "action": short.removesuffix("Action"), "msg": short}
    kind: Kind = "msg"
    if hasattr(cls, "_request_class"):
        kind = "srv"
    elif "action_goal" in cls.__slots__:
        kind = "action"
    return found.sources.find(kind, package, kinds[kind]) is not None


def action_on_ros2(network: Ros2, name: str, types: ActionTypes) -> ActionOnRos2:
    """Return an action as it is on a network.

    Raises:
        ConfigError: the action, or fields of its goal, result or feedback, have no counterpart;
            lists all of these fields.
    """
    mapped = _mapped(network, name)
    there, wanted = name, mapped.type if mapped else ""
    type_name = types.action._type
    if types.action._wire == "ros1":
        type_name = type_name.removesuffix("Action")
        if not wanted and type_name in KNOWN_ACTIONS:
            # The type alone gives the new type; the name changes only if it is the usual one.
            usual, successor, wanted = KNOWN_ACTIONS[type_name]
            front, _, last = name.rpartition("/")
            if last == usual:
                there = f"{front}/{successor}" if front else successor
    action = _looked_up(network, name, "action", wanted or type_name)
    problems: list[str] = []
    fields = _fields_of_parts(mapped, ("goal", "result", "feedback"), problems)

    def ways(part: str) -> tuple[Convert, Convert]:
        ours, theirs = getattr(types, part), getattr(action, part.title())
        return _ways(ours, theirs, fields[part], problems, f"{part}.")

    goal, result, feedback = ways("goal"), ways("result"), ways("feedback")
    if problems:
        raise ConfigError(f"ros2: {name}", *problems)
    return ActionOnRos2(mapped.name_there if mapped else there, action, *goal, *result, *feedback)


def message_on_ros2(network: Ros2, name: str, cls: Any) -> MessageOnRos2:
    """Return a topic as it is on a network; raises as `action_on_ros2`."""
    mapped = _mapped(network, name)
    theirs = _looked_up(network, name, "message", (mapped and mapped.type) or cls._type)
    problems: list[str] = []
    ways = _ways(cls, theirs, dict(mapped.fields) if mapped else {}, problems)
    if problems:
        raise ConfigError(f"ros2: {name}", *problems)
    return MessageOnRos2(name_on_ros2(network, name), theirs, *ways)


def service_on_ros2(
    network: Ros2, name: str, cls: Any
) -> tuple[type[ros2.Ros2Service], MessageOnRos2, MessageOnRos2]:
    """Return a service as it is on a network: its ROS 2 class, the request and the response.

    Raises:
        ConfigError: as `action_on_ros2`.
    """
    mapped = _mapped(network, name)
    theirs = _looked_up(network, name, "service", (mapped and mapped.type) or cls._type)
    problems: list[str] = []
    fields = _fields_of_parts(mapped, ("request", "response"), problems)
    there = name_on_ros2(network, name)
    request, response = (
        MessageOnRos2(there, part, *_ways(ours, part, fields[which], problems, f"{which}."))
        for which, ours, part in (
            ("request", cls._request_class, theirs.Request),
            ("response", cls._response_class, theirs.Response),
        )
    )
    if problems:
        raise ConfigError(f"ros2: {name}", *problems)
    return theirs, request, response


def name_on_ros2(network: Ros2, name: str) -> str:
    """Return a topic's or service's name on a network, before the network's namespace."""
    mapped = _mapped(network, name)
    return mapped.name_there if mapped else name


def _mapped(network: Ros2, name: str) -> Mapped | None:
    return next((entry for entry in network.map if entry.name == name), None)


def _fields_of_parts(
    mapped: Mapped | None, parts: tuple[str, ...], problems: list[str]
) -> dict[str, dict[str, str]]:
    """Return the pairs of fields of a name in the configuration by part: "goal.x": "goal.y".

    Pairs that belong to none of the parts are added to `problems`.
    """
    found: dict[str, dict[str, str]] = {part: {} for part in parts}
    for ours, theirs in mapped.fields if mapped else ():
        part, _, field = ours.partition(".")
        part_there, _, counterpart = theirs.rpartition(".")
        if field and part in found and part_there in {"", part}:
            found[part][field] = counterpart
        else:
            problems.append(
                f"fields: got '{ours}: {theirs}'; expected one of {', '.join(parts)} before the "
                f"name, the same on both sides: '{parts[0]}.x: {parts[0]}.y'."
            )
    return found


def _looked_up(network: Ros2, name: str, kind: str, type_name: str) -> Any:
    look_up = {
        "action": ros2.get_action,
        "message": ros2.get_message,
        "service": ros2.get_service,
    }[kind]
    try:
        return look_up(type_name, network.distro)
    except InterfaceError as error:
        raise ConfigError(
            f"ros2: {name}",
            f"{kind}: got {type_name!r}, which ROS 2 does not have under this name; expected a "
            f"type of ROS 2. Try 'map: {{{name}: {{type: pkg/Name}}}}'. {error}",
        ) from error


def _ways(
    ours: Any, theirs: Any, fields: dict[str, str], problems: list[str], part: str = ""
) -> tuple[Convert, Convert]:
    """Return the conversions from `ours` to `theirs` and back; add what does not fit to `problems`.

    Every field of `ours` needs a counterpart, in both directions; ROS 2 may have more fields.
    """
    try:
        return (
            converter(ours, theirs, fields, whole="source", part=part),
            converter(theirs, ours, fields, whole="target", part=part),
        )
    except CorrespondenceError as error:
        problems += error.problems
        # Placeholders: the caller raises when it has collected the problems of all parts.
        return (lambda message: message), (lambda message: message)
