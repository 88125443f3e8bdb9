"""What the commands need of the network: a node, who is there, and answers from a server."""

from __future__ import annotations

import contextlib
import difflib
import os
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from actionlib_core.cli import UsageError
from actionlib_core.cli._packages import known
from actionlib_core.presence import Endpoint, Kind, list_endpoints, parse_token, token_pattern

if TYPE_CHECKING:
    import argparse
    from collections.abc import Collection, Iterable, Iterator

    from actionlib_core.node import Node
    from actionlib_core.transport import Presence, Reply

SETTLE_S = 0.4  # the network is known when nobody new has shown up for so long
SETTLE_MOST_S = 3.0
FIND_S = 2.0  # a name that is not there then may still come within this: a busy machine is slow
ASK_S = 2.0

ACTION_KINDS = (Kind.ACTION_SERVER, Kind.ACTION_CLIENT)


@contextlib.contextmanager
def open_node(args: argparse.Namespace, *, settle: float = SETTLE_S) -> Iterator[Node]:
    """Give the command its node and close it afterwards.

    Args:
        args: What `main` has parsed.
        settle: Wait until nobody new has been found for so long [s]; 0 does not wait.
    """
    if args.node is not None:
        yield args.node
        return
    from actionlib_core.config import load_config
    from actionlib_core.node import Node

    config = load_config(args.config)
    with Node(
        f"actionlib_{os.getpid()}", config=config, namespace=config.namespace, arguments=args.names
    ) as node:
        if settle:
            _settle(node, settle)
        yield node


def _settle(node: Node, quiet: float) -> None:
    """Wait until nobody new has been found for `quiet` [s].

    Blocks: `SETTLE_MOST_S` at most.
    """
    news = node.clock.event()
    watch = node.transport.watch_alive(token_pattern(None, "**"), lambda _presence: news.set())
    deadline = node.clock.now() + SETTLE_MOST_S
    try:
        while news.wait(min(quiet, max(deadline - node.clock.now(), 0.0))):
            news.clear()
    finally:
        watch.close()


def find_by_name(node: Node, full: str, kinds: Collection[Kind]) -> list[Endpoint]:
    """Return the ends of a full name, of some kinds; waits a little for the first.

    Blocks: `FIND_S` at most.
    """

    def there() -> list[Endpoint]:
        return [end for end in list_endpoints(node.transport, name=full) if end.kind in kinds]

    found = there()
    if found:
        return found
    came = node.clock.event()

    def on_presence(presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None and presence.alive and end.kind in kinds:
            came.set()

    watch = node.transport.watch_alive(token_pattern(None, full), on_presence)
    try:
        came.wait(FIND_S)
    finally:
        watch.close()
    return there()


def which_there_are(wanted: str, names: Iterable[str]) -> str:
    """Return what to say when `wanted` is not there: the others, and the nearest.

    Args:
        wanted: A full name.
        names: The full names that are there.
    """
    there = [f"/{name}" for name in names]
    if not there:
        return "expected one, but there is none at all."
    near = difflib.get_close_matches(f"/{wanted}", there, n=1, cutoff=0.6)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    return f"expected one of {there}.{hint}"


def list_ends(node: Node, name: str = "**") -> dict[str, list[Endpoint]]:
    """Return the ends of actions, by full name."""
    found: dict[str, list[Endpoint]] = {}
    for end in list_endpoints(node.transport, name=name):
        if end.kind in ACTION_KINDS:
            found.setdefault(end.name, []).append(end)
    return dict(sorted(found.items()))


def show_type(type_name: str) -> str:
    """Return an action's type as ROS tools show it: `pkg/action/Name`."""
    package, _, name = type_name.partition("/")
    return f"{package}/action/{name.removesuffix('Action')}"


def find_ends(node: Node, name: str) -> list[Endpoint]:
    """Return the ends of an action.

    Raises:
        UsageError: there are none.
    """
    full = node.resolve(name, "action name")
    ends = find_by_name(node, full, ACTION_KINDS)
    if not ends:
        raise UsageError(
            f"action '/{full}': got no server and no client; "
            f"{which_there_are(full, list_ends(node))} Try 'actionlib list'."
        )
    return ends


def find_server(node: Node, name: str) -> Endpoint:
    """Return the server of an action.

    Raises:
        UsageError: there is none.
    """
    full = node.resolve(name, "action name")
    for end in find_by_name(node, full, (Kind.ACTION_SERVER,)):
        return end
    raise UsageError(
        f"action '/{full}': got no server; {which_there_are(full, list_servers(node))} "
        "Try 'actionlib list', or start its server."
    )


def list_servers(node: Node) -> list[str]:
    """Return the full names of the actions that have a server."""
    ends = list_endpoints(node.transport, kind=Kind.ACTION_SERVER)
    return sorted({end.name for end in ends})


def wait_for_server(node: Node, name: str, timeout: float | None) -> Endpoint:
    """Wait for the server of an action and return it.

    Raises:
        UsageError: there is none within `timeout` [s].

    Blocks: until there is one; None waits for ever.
    """
    full = node.resolve(name, "action name")
    found: list[Endpoint] = []
    there = node.clock.event()

    def on_presence(presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None and presence.alive:
            found.append(end)
            there.set()

    watch = node.transport.watch_alive(token_pattern(Kind.ACTION_SERVER, full), on_presence)
    try:
        there.wait(timeout)
    finally:
        watch.close()
    if not found:
        raise UsageError(
            f"action '/{full}': got no server within {timeout:g} s; "
            f"{which_there_are(full, list_servers(node))} Try 'actionlib list', or start its "
            "server."
        )
    return found[0]


def action_class(type_name: str) -> Any:
    """Return the class of an action.

    Raises:
        InterfaceError: its definition is not known here.
    """
    from actionlib_core.interfaces import get_action

    return known(get_action, type_name)


class Answer(NamedTuple):
    """What a server said about its goals."""

    encoding: str
    payload: bytes


def ask(node: Node, name: str, goal_id: str, about: Literal["result", "goal"] = "result") -> Answer:
    """Ask the server of an action about a goal, or about all ("").

    Args:
        node: Asks.
        name: The action.
        goal_id: The goal, "" for all.
        about: What became of it, or what it was.

    Raises:
        UsageError: no answer came.

    Blocks: `ASK_S` at most.
    """
    from actionlib_core._action_wire import action_keys, pack_goal_id
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
    from actionlib_core.wire import encoding_of

    replies: list[Reply] = []
    done = node.clock.event()
    full = node.resolve(name, "action name")
    node.transport.query(
        getattr(action_keys(full), about),
        pack_goal_id(goal_id, 0),
        encoding=encoding_of(GoalID),
        timeout=ASK_S,
        on_reply=replies.append,
        on_done=done.set,
    )
    done.wait(ASK_S + 1.0)
    for reply in replies:
        if not reply.error:
            return Answer(reply.encoding, reply.payload)
    if replies:
        raise UsageError(replies[0].payload.decode(errors="replace"))
    raise UsageError(
        f"action '/{full}': got no answer within {ASK_S:g} s; expected one. Try 'actionlib info'."
    )
