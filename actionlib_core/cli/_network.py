"""Network functions of the commands: a node, the ends on the network, and queries to servers."""

from __future__ import annotations

import contextlib
import os
import sys
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from actionlib_core.cli import UsageError
from actionlib_core.cli._ros2 import explain_absence, is_ros2, merged, typed, watching
from actionlib_core.exceptions import InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.process.output import tell
from actionlib_core.transport.tokens import Kind, parse_token, token_pattern
from actionlib_core.wire.presence import SETTLE_MOST_S, SETTLE_S, list_endpoints, settle_network

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Collection, Iterable, Iterator

    from actionlib_core.node import Node
    from actionlib_core.transport import Presence, Reply
    from actionlib_core.transport.tokens import Endpoint

ABSENT_S = 3.0  # after this time without an action server, print where it was looked for
FIND_S = 2.0  # a missing name may still appear within this time, on a busy computer
ASK_S = 2.0  # longest wait for an answer

ACTION_KINDS = (Kind.ACTION_SERVER, Kind.ACTION_CLIENT)
TOPIC_KINDS = (Kind.PUBLISHER, Kind.SUBSCRIBER)
SERVICE_KINDS = (Kind.SERVICE,)
_WORDS = {  # kind -> word for a name, ROS's word for its types, the command that lists it
    **dict.fromkeys(ACTION_KINDS, ("action", "action", "list")),
    **dict.fromkeys(TOPIC_KINDS, ("topic", "msg", "topic list")),
    **dict.fromkeys(SERVICE_KINDS, ("service", "srv", "service list")),
}

INTERFACES = "smachpy.interfaces"
"""Entry points of modules that register definitions when they are imported."""

T = TypeVar("T")


@contextlib.contextmanager
def open_node(args: argparse.Namespace, *, settle: float = SETTLE_S) -> Iterator[Node]:
    """Open the command's node, and close it afterwards.

    Args:
        args: The parsed arguments.
        settle: Wait until no new end was found for this time [s]; 0: do not wait. `args.settled`
            tells afterwards whether it was so.
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
            args.settled = settle_network(node.transport, node.clock, settle)
        yield node


# -- ends ------------------------------------------------------------------------------------------


def list_names(node: Node, kinds: Collection[Kind]) -> dict[str, list[Endpoint]]:
    """Return the present ends of the given kinds, by full name.

    Blocks: until the network has answered, `SETTLE_MOST_S` at most.
    """
    found: dict[str, list[Endpoint]] = {}
    ends = list_endpoints(node.transport, timeout=SETTLE_MOST_S)
    for end in merged(ends, node, kinds):
        found.setdefault(end.name, []).append(end)
    return dict(sorted(found.items()))


def find_by_name(
    node: Node, full: str, kinds: Collection[Kind], timeout: float | None = FIND_S
) -> list[Endpoint]:
    """Return the ends of a full name, of the given kinds; wait for the first one.

    Blocks: until there is one, `timeout` [s] at most; None: no limit.
    """
    late: list[Endpoint] = []
    came = node.clock.event()

    def on_end(end: Endpoint) -> None:
        if end.name == full and end.kind in kinds:
            late.append(end)
            came.set()

    def on_presence(presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None and presence.alive:
            on_end(end)

    def there() -> list[Endpoint]:
        ends = merged(list_endpoints(node.transport, name=full), node, kinds, full)
        return [end for end in ends if end.name == full]

    found = there()
    if found:
        return found
    # Not found at once: a program that has just joined may not have discovered all others.
    watch = node.transport.watch_alive(token_pattern(None, full), on_presence)
    try:
        with watching(node, full, on_end):
            if timeout is None and Kind.ACTION_SERVER in kinds and not came.wait(ABSENT_S):
                _print_absence(node, full)
            came.wait(timeout)
    finally:
        watch.close()
    return there() or late


def _print_absence(node: Node, full: str) -> None:
    why = explain_absence(node, full)
    print(f"actionlib: action '/{full}': no server yet: {why}", file=sys.stderr)


def find_ends(
    node: Node, name: str, kinds: Collection[Kind], timeout: float | None = FIND_S
) -> list[Endpoint]:
    """Return the ends of a name in a command line, of the given kinds; at least one.

    Raises:
        UsageError: there are none; the text lists the names that exist.

    Blocks: as `find_by_name`.
    """
    what, _, listing = _WORDS[next(iter(kinds))]
    full = node.resolve(name, f"{what} name")
    found = find_by_name(node, full, kinds, timeout)
    if not found:
        within = "" if timeout is None else f" within {timeout:g} s"
        missing, way_out = f"not there{within}", f"Try 'actionlib {listing}'."
        if Kind.ACTION_CLIENT not in kinds and what == "action":
            missing = f"got no server{within}"
            way_out = f"Try 'actionlib {listing}', or start its server."
        there = which_there_are(full, list_names(node, kinds))
        if what == "action" and node.config.ros2:
            why = explain_absence(node, full)
            there, way_out = "expected one.", f"{why[0].upper()}{why[1:]}"
        raise UsageError(f"{what} '/{full}': {missing}; {there} {way_out}")
    return found


def find_server(node: Node, name: str, timeout: float | None = FIND_S) -> Endpoint:
    """Return the server of an action; raises and blocks as `find_ends`."""
    return find_ends(node, name, (Kind.ACTION_SERVER,), timeout)[0]


def which_there_are(wanted: str, names: Iterable[str]) -> str:
    """Return the part of an error text that lists the existing names and the most similar one.

    Args:
        wanted: The full name that was not found.
        names: The full names that exist.
    """
    there = [f"/{name}" for name in names]
    if not there:
        return "expected one, but there is none at all."
    return f"expected one of {there}.{did_you_mean(f'/{wanted}', there)}"


# -- types -----------------------------------------------------------------------------------------


def show_type(kind: Kind, type_name: str) -> str:
    """Return a type as ROS tools show it: `pkg/msg/Name`, `pkg/action/Name`."""
    if is_ros2(type_name):
        return type_name
    package, _, name = type_name.partition("/")
    section = _WORDS[kind][1]
    return f"{package}/{section}/{name.removesuffix('Action') if section == 'action' else name}"


def types_of(ends: Iterable[Endpoint]) -> list[str]:
    """Return the types of ends as ROS tools show them."""
    return sorted({show_type(end.kind, end.type) for end in ends})


def only_type(ends: list[Endpoint], name: str) -> str:
    """Return the type of all ends of a name.

    Raises:
        UsageError: the ends have several types.
    """
    types = sorted({end.type for end in ends})
    if len(types) > 1:
        what = _WORDS[ends[0].kind][0]
        raise UsageError(f"{what} '{name}': got types {types}; expected one. Try naming it.")
    return types[0]


def load_packages() -> None:
    """Register the definitions of installed packages.

    Raises:
        InterfaceError: such a package cannot be imported.
    """
    for point in entry_points(group=INTERFACES):
        try:
            point.load()
        except Exception as error:
            # A package in the current folder may hide an installed one with the same name. Then
            # only the definitions of the hidden one are missing.
            absent = isinstance(error, ModuleNotFoundError) and error.name
            if absent and f"{point.module}.".startswith(f"{absent}."):
                tell("actionlib", f"interfaces of {point.name!r} are not known: {error}")
                continue
            raise InterfaceError(
                f"interfaces of {point.name!r}: importing {point.value!r} raised "
                f"{type(error).__name__}: {error}."
            ) from error


def known(get: Callable[[str], T], name: str) -> T:
    """Return `get(name)`, if necessary after loading installed packages.

    Raises:
        InterfaceError: there is no such definition.
    """
    try:
        return get(name)
    except InterfaceError:
        load_packages()  # costs an import, so only now
        return get(name)


def class_of_end(node: Node, end: Endpoint) -> Any:
    """Return the class of an end's type, of ROS 1 or of ROS 2.

    Raises:
        InterfaceError: its definition is unknown here, or differs from a ROS 2 robot's.
    """
    if is_ros2(end.type):
        from actionlib_core.wire.ros2.ends import class_of

        load_packages()
        return class_of(node, end)
    from actionlib_core.interfaces import get_action, get_message, get_service

    get: dict[str, Callable[[str], Any]] = {
        "action": get_action,
        "msg": get_message,
        "srv": get_service,
    }
    return known(get[_WORDS[end.kind][1]], end.type)


def typed_class(node: Node, kind: Literal["action", "message", "service"], name: str) -> Any:
    """Return the class of a type in a command line: a ROS 2 class if such a robot is configured.

    Raises:
        InterfaceError: its definition is unknown here.
    """
    from actionlib_core import interfaces

    found = typed(node, kind, name)
    return found if found is not None else known(getattr(interfaces, f"get_{kind}"), name)


# -- goals -----------------------------------------------------------------------------------------


def ask(
    node: Node,
    name: str,
    goal_id: str,
    read: Callable[[Reply], T],
    about: Literal["result", "goal"] = "result",
) -> T:
    """Query the server of an action for a goal, or for the status list.

    Args:
        node: The command's node.
        name: The action.
        goal_id: The goal; "": all goals.
        read: Reads an answer; a ValueError if it cannot. Anybody may answer: the first answer that
            can be read counts.
        about: "result": its result or status; "goal": its goal message.

    Raises:
        UsageError: there was no answer that can be read, or an error.

    Blocks: `ASK_S` at most.
    """
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID
    from actionlib_core.wire.actions import action_keys, pack_goal_id
    from actionlib_core.wire.encoding import encoding_of

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
    problem = f"got no answer within {ASK_S:g} s; expected one"
    # An answer of one server counts more than the error of another.
    for reply in sorted(replies, key=lambda reply: reply.error):
        if reply.error:
            raise UsageError(reply.payload.decode(errors="replace"))
        try:
            return read(reply)
        except ValueError as error:
            problem = f"got an answer that cannot be read ({error}); expected that of its server"
    raise UsageError(f"action '/{full}': {problem}. Try 'actionlib info'.")
