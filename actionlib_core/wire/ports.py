"""Which wire an action is on: its type says so."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actionlib_core.goal.ports import ServerPort
    from actionlib_core.node import Node
    from actionlib_core.wire.action_messages import ActionTypes


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
