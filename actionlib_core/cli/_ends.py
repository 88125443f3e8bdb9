"""Who is at a topic or a service, for the commands about them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.cli import UsageError
from actionlib_core.cli._network import find_by_name, which_there_are
from actionlib_core.presence import list_endpoints

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint, Kind


def ends_by_name(node: Node, kinds: Iterable[Kind]) -> dict[str, list[Endpoint]]:
    """Return the ends of some kinds there are, by full name.

    Blocks: until the network has answered, a second at most.
    """
    wanted = frozenset(kinds)
    found: dict[str, list[Endpoint]] = {}
    for end in list_endpoints(node.transport):
        if end.kind in wanted:
            found.setdefault(end.name, []).append(end)
    return dict(sorted(found.items()))


def find_ends(node: Node, name: str, kinds: Iterable[Kind], what: str) -> list[Endpoint]:
    """Return the ends of a name, of some kinds.

    Args:
        node: Where to look.
        name: As typed by the user.
        kinds: Which ends count.
        what: What the name is, for the error text: "topic".

    Raises:
        UsageError: there are none; the text says which there are.
    """
    full = node.resolve(name, f"{what} name")
    found = find_by_name(node, full, tuple(kinds))
    if not found:
        there = which_there_are(full, ends_by_name(node, kinds))
        raise UsageError(f"{what} '/{full}': not there; {there} Try 'actionlib {what} list'.")
    return found


def types_of(ends: Iterable[Endpoint], kind: str) -> list[str]:
    """Return the types of ends as ROS tools show them: `pkg/msg/Name`."""
    pairs = {end.type.partition("/")[::2] for end in ends}
    return sorted(f"{package}/{kind}/{name}" for package, name in pairs)


def only_type(ends: Iterable[Endpoint], name: str, what: str) -> str:
    """Return the type that all ends have.

    Raises:
        UsageError: they have several.
    """
    types = sorted({end.type for end in ends})
    if len(types) > 1:
        raise UsageError(f"{what} '{name}': got types {types}; expected one. Try naming it.")
    return types[0]
