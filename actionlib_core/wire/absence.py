"""Why nobody may have a name: where it was looked for, and which names there are.

A misspelt name, another domain or a program that was not started all look the same: nothing comes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.inputs.suggest import did_you_mean, nearest
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.presence import list_endpoints

if TYPE_CHECKING:
    from collections.abc import Collection

    from actionlib_core.config import Config
    from actionlib_core.node import Node

ABSENT_S = 3.0  # a wait that has lasted this long tells what it waits for
LIST_S = 0.3  # longest wait for the names that there are
SHOWN = 8  # names in a text

_WORDS = {  # kind of the missing end -> names in general, what nobody of them has
    Kind.ACTION_SERVER: ("actions", "no action has a server"),
    Kind.SERVICE: ("services", "no service has a server"),
    Kind.PUBLISHER: ("topics", "no topic has a publisher"),
    Kind.SUBSCRIBER: ("topics", "no topic has a subscriber"),
}


def explain_absence(node: Node, full: str, kind: Kind) -> str:
    """Explain why a name may have no end of a kind, and what to try.

    Args:
        node: The node that looks for it.
        full: The full name.
        kind: The kind of the missing end: ACTION_SERVER, SERVICE, PUBLISHER or SUBSCRIBER.

    Raises:
        TransportError: the session is closed.

    Blocks: until the network has answered, `LIST_S` at most.
    """
    found = list_endpoints(node.transport, kind=kind, timeout=LIST_S)
    where = describe_network(node.config) if node.owns_transport else "the program's network"
    return f"looked at {where}: {names_there(full, {end.name for end in found}, kind)}"


def names_there(full: str, names: Collection[str], kind: Kind) -> str:
    """Return which names there are, the most similar first, and whether one of them is meant."""
    what, nobody = _WORDS[kind]
    if full in names:
        return "it is just starting."
    if not names:
        return f"{nobody}. Is it started, in the same domain and with the same configuration?"
    there = sorted(f"/{name}" for name in names)
    near = nearest(f"/{full}", there, most=SHOWN)
    shown = (near + [name for name in there if name not in near])[:SHOWN]
    more = f" and {len(there) - len(shown)} more" if len(there) > len(shown) else ""
    return f"{what}: {', '.join(shown)}{more}.{did_you_mean(f'/{full}', there)}"


def describe_network(config: Config) -> str:
    """Return the network that a configuration joins, as part of a sentence."""
    if config.mode == "client":
        return f"router {', '.join(config.connect)}"
    linked = f"with links to {', '.join(config.connect)}" if config.connect else ""
    if config.discovery == "off":
        return f"a network without discovery {linked or 'and without links'}"
    where = "this computer" if config.discovery == "lo" else f"interface {config.discovery!r}"
    return f"{where}, domain {config.domain}{f', {linked}' if linked else ''}"
