"""Which wire an action is on: its type says so, or the configuration of its name."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.goal.ports import ClientPort, ServerPort
    from actionlib_core.node import Node
    from actionlib_core.wire.action_messages import ActionTypes


def make_client_port(
    node: Node,
    name: str,
    types: ActionTypes,
    spawn: Callable[[Callable[[], object], str], object],
) -> ClientPort:
    """Return the client's end of the action with the full name `name`.

    Args:
        node: On whose network.
        name: See above.
        types: The action's message classes.
        spawn: Starts a named thread for a burst of feedback.

    Raises:
        ConfigError: the action is one of ROS 2, and no network of ROS 2 has the name; or it has no
            counterpart on the network that has it.
        TransportError: that network cannot be joined.

    Blocks: the first time on a network of ROS 2, until it is joined.
    """
    if _is_on_ros2(node, name, types):
        from actionlib_core.wire.ros2.client_port import RosClientPort

        return RosClientPort(node, name, types, spawn)
    from actionlib_core.wire.client_port import ActionClientPort

    return ActionClientPort(node, name, types, spawn)


def make_server_port(node: Node, name: str, types: ActionTypes) -> ServerPort:
    """Return the server's end of the action with the full name `name`.

    Raises:
        ConfigError: the action is one of ROS 2, and no network of ROS 2 has the name.
        TransportError: that network cannot be joined.

    Blocks: the first time on a network of ROS 2, until it is joined.
    """
    if getattr(types.action, "_wire", "") == "ros2":
        from actionlib_core.wire.ros2.server_port import RosServerPort

        return RosServerPort(node, name, types)
    from actionlib_core.wire.server_port import ActionServerPort

    return ActionServerPort(node, name, types)


def _is_on_ros2(node: Node, name: str, types: ActionTypes) -> bool:
    """Return whether an action is on a network of ROS 2."""
    wire = getattr(types.action, "_wire", "ros1")
    if wire == "ros1" and not node.config.ros2:  # without loading what ROS 2 needs
        return False
    from actionlib_core.wire.ros2.mapping import find_network

    return find_network(node, name, types.action) is not None
