"""Choice of an action's wire: by its type, or by the configuration of its name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import InterfaceError
from actionlib_core.transport.tokens import Kind, token_pattern
from actionlib_core.wire import looked_for
from actionlib_core.wire.action_types import ActionTypes

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.goal.ports import ClientPort, ServerPort
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence


def make_client_port(
    node: Node,
    name: str,
    types: ActionTypes,
    spawn: Callable[[Callable[[], object], str], object],
) -> ClientPort:
    """Return a client's port of the action with the full name `name`.

    Args:
        node: The client's node.
        name: See above.
        types: The action's message classes.
        spawn: Starts a named thread for a burst of feedback.

    Raises:
        ConfigError: the action has a ROS 2 type and its name is on no configured ROS 2 network; or
            its type has no counterpart on the network of its name.
        TransportError: that network cannot be joined.

    Blocks: the first time on a ROS 2 network, until it is joined.

    Threads: any. The listener is called on the network's threads; for a burst of feedback, on a
        thread of its own.
    """
    # Imported here, and below: most programs need one of the two wires only.
    if _is_on_ros2(node, name, types):
        from actionlib_core.wire.ros2.client_port import RosClientPort

        return RosClientPort(node, name, types, spawn)
    from actionlib_core.wire.actions import ActionClientPort

    return ActionClientPort(node, name, types, spawn)


def make_server_port(node: Node, name: str, types: ActionTypes) -> ServerPort:
    """Return a server's port of the action with the full name `name`.

    Raises and blocks: as `make_client_port`.
    """
    if _is_on_ros2(node, name, types):
        from actionlib_core.wire.ros2.server_port import RosServerPort

        return RosServerPort(node, name, types)
    from actionlib_core.wire.actions import ActionServerPort

    return ActionServerPort(node, name, types)


def watch_for_server(
    node: Node, name: str, type_name: str, on_there: Callable[[], object]
) -> Closable:
    """Call `on_there` for each present and future server of an action, on either wire.

    Args:
        node: The node whose networks are watched.
        name: The action's full name.
        type_name: Its type, "pkg/NameAction", or in ROS 2 "pkg/action/Name".
        on_there: Called on the network's threads; must not block.

    Raises:
        ConfigError: As `make_client_port`.
        TransportError: a ROS 2 network cannot be joined.

    Blocks: as `make_client_port`.
    """
    types = _types_of(type_name) if node.config.ros2 or type_name.count("/") > 1 else None
    if types is None or not _is_on_ros2(node, name, types):

        def on_presence(presence: Presence) -> None:
            if presence.alive:
                on_there()

        looked_for.actions.add(name)  # a bridge then looks for it on its robot
        pattern = token_pattern(Kind.ACTION_SERVER, name)
        return node.transport.watch_alive(pattern, on_presence)
    from actionlib_core.wire.ros2.mapping import action_on_ros2
    from actionlib_core.wire.ros2.names import Kind as RosKind
    from actionlib_core.wire.ros2.names import action_names
    from actionlib_core.wire.ros2.network import ros_network

    network = ros_network(node, name)
    there = network.name(action_on_ros2(network.settings, name, types).name)

    def on_token(_token: object, _key: str, alive: bool) -> None:
        if alive:
            on_there()

    return network.ros.watch(on_token, kind=RosKind.SERVICE, name=action_names(there).send_goal)


def is_on_ros2(node: Node, name: str, type_name: str) -> bool:
    """Return whether an action is on a ROS 2 network; as `watch_for_server`, without joining."""
    types = _types_of(type_name)
    return types is not None and _is_on_ros2(node, name, types)


def _types_of(type_name: str) -> ActionTypes | None:
    """Return the message classes of an action; None when its definition is unknown."""
    from actionlib_core.interfaces import get_action, ros2

    try:
        found: Any = (ros2.get_action if type_name.count("/") > 1 else get_action)(type_name)
    except InterfaceError:
        return None
    return ActionTypes.of(found)


def _is_on_ros2(node: Node, name: str, types: ActionTypes) -> bool:
    """Return whether an action is on a ROS 2 network."""
    wire = getattr(types.action, "_wire", "ros1")
    if wire == "ros1" and not node.config.ros2:  # decided without importing the ROS 2 modules
        return False
    from actionlib_core.wire.ros2.mapping import find_network

    return find_network(node, name, types.action) is not None
