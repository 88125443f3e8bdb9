"""rosnode: lists the nodes.

Source:
    rosnode of ros_comm for names, arguments and exceptions.
"""

from __future__ import annotations

from actionlib_core.node import get_node
from actionlib_core.wire.presence import list_endpoints
from smachpy.ros1.names.rospy.client import MasterProxy
from smachpy.ros1.names.rospy.names import get_name, resolve_name

__all__ = ["ROSNodeException", "get_node_names", "rosnode_ping"]


class ROSNodeException(Exception):  # noqa: N818  rosnode's name
    """The nodes cannot be listed."""


def get_node_names(namespace: str | None = None) -> list[str]:
    """Return the names of the nodes that serve, publish or subscribe, and of this node."""
    prefix = "/" if namespace is None else f"/{namespace.strip('/')}/".replace("//", "/")
    _, _, parts = MasterProxy().getSystemState()
    names = {node for part in parts for _, nodes in part for node in nodes}
    names |= {f"/{end.node}" for end in list_endpoints(get_node().transport)} | {get_name()}
    return sorted(name for name in names if name.startswith(prefix))


def rosnode_ping(
    node_name: str, max_count: int | None = None, verbose: bool = False, skip_cache: bool = False
) -> bool:
    """Return whether a node is present."""
    del max_count, verbose, skip_cache
    return resolve_name(node_name) in get_node_names()
