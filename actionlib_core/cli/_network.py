"""What the commands need of the network: a node, who is there, and answers from a server."""

from __future__ import annotations

import contextlib
import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.cli import UsageError
from actionlib_core.presence import Endpoint, Kind, list_endpoints, parse_token, token_pattern

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from actionlib_core.node import Node
    from actionlib_core.transport import Presence, Reply

SETTLE_S = 0.4  # peers on one machine find each other within this
ASK_S = 2.0

ACTION_KINDS = (Kind.ACTION_SERVER, Kind.ACTION_CLIENT)


@contextlib.contextmanager
def open_node(args: argparse.Namespace, *, settle: float = SETTLE_S) -> Iterator[Node]:
    """Give the command its node and close it afterwards.

    Args:
        args: What `main` has parsed.
        settle: How long to wait until the others have been found [s]; 0 does not wait.
    """
    if args.node is not None:
        yield args.node
        return
    from actionlib_core.config import load_config
    from actionlib_core.node import Node

    config = load_config(args.config)
    config = replace(config, settle=max(config.settle, settle))
    with Node(
        f"actionlib_{os.getpid()}", config=config, namespace=config.namespace, arguments=args.names
    ) as node:
        yield node


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
    ends = list_ends(node, full).get(full)
    if not ends:
        raise UsageError(
            f"action '/{full}': got no server and no client; expected one. Try 'actionlib list'."
        )
    return ends


def find_server(node: Node, name: str) -> Endpoint:
    """Return the server of an action.

    Raises:
        UsageError: there is none.
    """
    full = node.resolve(name, "action name")
    for end in list_ends(node, full).get(full, []):
        if end.kind is Kind.ACTION_SERVER:
            return end
    raise UsageError(
        f"action '/{full}': got no server; expected one. Try 'actionlib list', or start its server."
    )


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
            f"action '/{full}': got no server within {timeout:g} s; expected one. Try 'actionlib "
            "list', or start its server."
        )
    return found[0]


def action_class(type_name: str) -> Any:
    """Return the class of an action.

    Raises:
        InterfaceError: its definition is not known here.
    """
    from actionlib_core.interfaces import get_action

    return get_action(type_name)


class Answer(NamedTuple):
    """What a server said about its goals."""

    encoding: str
    payload: bytes


def ask(node: Node, name: str, goal_id: str) -> Answer:
    """Ask the server of an action about a goal, or about all ("").

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
        action_keys(full).result,
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
    raise UsageError(
        f"action '/{full}': got no answer within {ASK_S:g} s; expected one. Try 'actionlib info'."
    )
