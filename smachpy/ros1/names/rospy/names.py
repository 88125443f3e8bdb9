"""Names as in rospy, with a slash in front."""

from __future__ import annotations

import re

from actionlib_core.node import get_node
from smachpy.ros1.session import session

__all__ = [
    "Named",
    "get_caller_id",
    "get_name",
    "get_namespace",
    "get_resolved_mappings",
    "remap_name",
    "resolve_name",
]


def get_name() -> str:
    """Return the full name of the program's node; "/unnamed" before `init_node`."""
    if not session().name:
        return "/unnamed"
    node = get_node()
    return f"/{node.full_name}" if session().named_node else f"{get_namespace()}{session().name}"


get_caller_id = get_name


def get_namespace() -> str:
    """Return the namespace of relative names, with a slash at either side."""
    space = get_node().namespace if session().name else ""
    return f"/{space}/" if space else "/"


def resolve_name(name: str, caller_id: str | None = None) -> str:
    """Return the full name, remapped.

    Args:
        name: A relative, absolute or private name; "": the namespace itself.
        caller_id: Full name of the node for private names; None: this node.
    """
    if not name:
        return get_namespace()
    name = re.sub("//+", "/", name)
    if name in {"/", "~"}:
        return "/" if name == "/" else get_name()
    name = name.rstrip("/")
    node = caller_id or _own_name()
    # The rules for characters are not applied: ROS's parameters may have any name.
    if name[0] == "~":
        full = f"{node}/{name[1:].lstrip('/')}"
    else:
        full = name if name[0] == "/" else f"{node.rpartition('/')[0]}/{name}"
    return get_resolved_mappings().get(full, full)


def _own_name() -> str:
    return get_name() if session().name else f"/{get_node().full_name}"


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """Return the full name of `name` after the remappings of the command line."""
    del resolved
    return resolve_name(name, caller_id)


def get_resolved_mappings() -> dict[str, str]:
    """Return the remappings of the command line, as full names."""
    node = get_node()
    name, full = session().name or node.name, _own_name().strip("/")
    rules = node.arguments.remappings(name, namespace=node.namespace, node=full)
    return {f"/{old}": f"/{new}" for old, new in rules.items()}


class Named:
    """An end of a topic or service with rospy's `resolved_name`, which has a slash in front."""

    _full_name: str

    @property
    def resolved_name(self) -> str:
        """The full name, remapped."""
        return f"/{self._full_name}"
