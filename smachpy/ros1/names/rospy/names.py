"""Names as in rospy, with a slash in front."""

from __future__ import annotations

import re

from actionlib_core.names import resolve_name as _resolve
from actionlib_core.node import get_node
from smachpy.ros1.session import session

__all__ = [
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
    name = canonical(name)
    name = name.rstrip("/") if len(name) > 1 else name
    if name in {"/", "~"}:
        return "/" if name == "/" else get_name()
    now = session()
    # The node of a program that is only built has another name than the program gives it.
    if caller_id is None and (name[0] != "~" or now.named_node or not now.name):
        return f"/{get_node().resolve(name)}"
    node = (caller_id or get_name()).strip("/")
    return f"/{_resolve(name, namespace=node.rpartition('/')[0], node=node)}"


def canonical(name: str) -> str:
    """Return a name with single slashes: rospy accepts doubled ones."""
    return re.sub("//+", "/", name) if isinstance(name, str) else name  # it may be a stand-in


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """Return the full name of `name` after the remappings of the command line."""
    del resolved
    return resolve_name(name, caller_id)


def get_resolved_mappings() -> dict[str, str]:
    """Return the remappings of the command line, as full names."""
    node = get_node()
    rules = node.arguments.remappings(node.name, namespace=node.namespace, node=node.full_name)
    return {f"/{old}": f"/{new}" for old, new in rules.items()}
