"""`actionlib topic list|info|type|echo|pub|hz|bw`, with the flags of `ros2 topic`."""

from __future__ import annotations

import contextlib
import itertools
import json
import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED, UsageError, _topic_rates
from actionlib_core.cli._command import add_command, json_text, print_progress
from actionlib_core.cli._feed import Feed
from actionlib_core.cli._listing import add_list, add_type
from actionlib_core.cli._network import (
    FIND_S,
    TOPIC_KINDS,
    class_of_end,
    find_ends,
    list_names,
    only_type,
    open_node,
    typed_class,
    types_of,
)
from actionlib_core.cli._ros2 import is_ros2
from actionlib_core.command_line.numbers import count, rate, seconds, size
from actionlib_core.transport.tokens import Kind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.transport.tokens import Endpoint


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser("topic", help="list, watch and publish topics")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    listing = add_list(verbs, "topics", TOPIC_KINDS, _record)
    listing.add_argument(
        "-v", "--verbose", dest="run", action="store_const", const=_list_by_direction,
        help="with publishers, subscribers",
    )  # fmt: skip
    add_type(verbs, "a topic", TOPIC_KINDS)
    info = add_command(verbs, "info", _info, "show its publishers and subscribers")
    info.add_argument("name", metavar="NAME")
    info.add_argument("-v", "--verbose", action="store_true", help="with nodes and checksums")
    _register_echo(add_command(verbs, "echo", _echo, "print the messages of a topic"))
    _register_pub(add_command(verbs, "pub", _pub, "publish to a topic"))
    _topic_rates.register(verbs)


def _register_echo(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("type", metavar="TYPE", nargs="?", help="default: what its ends say")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N messages")
    parser.add_argument(
        "--timeout",
        type=seconds,
        metavar="S",
        help="longest wait for the topic and for each message [s]",
    )
    parser.add_argument(
        "--filter", metavar="EXPR", help="only messages for which this holds: 'data > 3'"
    )
    parser.add_argument("--field", metavar="PATH", help="only this field: pose.position, data[0]")
    parser.add_argument("--csv", action="store_true", help="one line per message")
    parser.add_argument("--raw", action="store_true", help="the bytes, undecoded")
    parser.add_argument("--no-arr", action="store_true", help="arrays as their length")
    parser.add_argument("--no-str", action="store_true", help="texts as their length")
    parser.add_argument("--flow-style", action="store_true", help="collections on one line")
    parser.add_argument("-f", "--full-length", action="store_true", help="nothing shortened")
    parser.add_argument(
        "-l", "--truncate-length", type=size, default=128, metavar="N",
        help="shorten arrays and texts to N (default: 128)",
    )  # fmt: skip


def _register_pub(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("type", metavar="TYPE")
    parser.add_argument("values", metavar="YAML", nargs="?", default="", help="'{data: hello}'")
    parser.add_argument("-r", "--rate", type=rate, metavar="HZ", help="default: 1 Hz")
    parser.add_argument("-1", "--once", action="store_true", help="one message, then end")
    parser.add_argument("-t", "--times", type=count, metavar="N", help="N messages, then end")
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=size, metavar="N",
        help="wait for N subscribers (default: 1 with --once and --times, else 0)",
    )  # fmt: skip
    parser.add_argument("--timeout", type=seconds, metavar="S", help="longest wait for them [s]")
    parser.add_argument("--latch", action="store_true", help="keep it for late subscribers")
    parser.add_argument(
        "--stdin", action="store_true", help="one message per YAML document from standard input"
    )


# -- publishers and subscribers --------------------------------------------------------------------


def _list_by_direction(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        topics = list_names(node, TOPIC_KINDS)
    if args.json:
        print(json.dumps([_record(name, ends) for name, ends in topics.items()]))
        return 0
    for title, kind in (("Published", Kind.PUBLISHER), ("Subscribed", Kind.SUBSCRIBER)):
        print(f"{title} topics:")
        for name, ends in topics.items():
            number = sum(end.kind is kind for end in ends)
            if number:
                types, plural = ", ".join(types_of(ends)), "" if number == 1 else "s"
                print(f" * /{name} [{types}] {number} {kind.value}{plural}")
        print()
    return 0


def _record(name: str, ends: list[Endpoint]) -> dict[str, Any]:
    return {
        "name": f"/{name}",
        "types": types_of(ends),
        "publishers": [f"/{end.node}" for end in ends if end.kind is Kind.PUBLISHER],
        "subscribers": [f"/{end.node}" for end in ends if end.kind is Kind.SUBSCRIBER],
    }


def _info(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name, TOPIC_KINDS)
    if args.json:
        print(json.dumps(_record(ends[0].name, ends)))
        return 0
    print(f"Type: {', '.join(types_of(ends))}")
    for title, kind in (("Publisher", Kind.PUBLISHER), ("Subscription", Kind.SUBSCRIBER)):
        group = [end for end in ends if end.kind is kind]
        print(f"{title} count: {len(group)}")
        for end in group if args.verbose else ():
            checksum = "type hash" if is_ros2(end.type) else "md5"
            print(f"  Node: /{end.node}  type: {end.type}  {checksum}: {end.md5}")
    return 0


# -- messages --------------------------------------------------------------------------------------


def _message_class(node: Node, args: argparse.Namespace) -> type[Message]:
    """Return the class of a topic's messages; an unknown one is defined by its publisher."""
    from actionlib_core.exceptions import InterfaceError
    from actionlib_core.wire.definitions import ask_definition, define

    if args.type:
        return typed_class(node, "message", args.type)  # type: ignore[no-any-return] # a message
    ends = find_ends(node, args.name, TOPIC_KINDS, args.timeout or FIND_S)
    type_name = only_type(ends, args.name)
    try:
        return class_of_end(node, ends[0])  # type: ignore[no-any-return] # as above
    except InterfaceError:
        text = ask_definition(node, type_name, ends[0].md5)
        if text is None:
            raise
        return define(type_name, ends[0].md5, text)


def _echo(args: argparse.Namespace) -> int:
    from actionlib_core.cli._message_text import MessageText
    from actionlib_core.pubsub.topic import Subscriber

    limit = 1 if args.once else args.count
    wanted = _Filter(args.filter) if args.filter else None
    if wanted is not None and args.raw:
        raise UsageError("topic echo: got --filter beside --raw; expected one of the two.")
    with open_node(args) as node, contextlib.ExitStack() as stack:
        feed = Feed(node.clock)
        if args.raw:
            show: Callable[[Any], str] = "{0!r}\n---".format
            stack.enter_context(
                _topic_rates.listening(
                    node, args.name, lambda sample: feed.put(sample.payload, len)
                )
            )
        else:
            show = MessageText(args).format
            kind = _message_class(node, args)
            stack.enter_context(Subscriber(args.name, kind, feed.put, _size, node=node))
        shown = 0
        while limit is None or shown < limit:
            deadline = None if args.timeout is None else node.clock.now() + args.timeout
            try:
                item = feed.next(deadline)
                while wanted is not None and not wanted(item.to_dict()):
                    item = feed.next(deadline)
            except TimeoutError:
                return _nothing(args)
            print(show(item), flush=True)
            shown += 1
    return 0


def _size(message: Any) -> int:
    return len(message.to_cdr() if message._wire == "ros2" else message.to_bytes())


class _Filter:
    """The condition of `--filter`."""

    def __init__(self, text: str) -> None:
        from actionlib_core.inputs.expression import Expression

        with _of_filter():
            self._expression = Expression(text)

    def __call__(self, fields: dict[str, Any]) -> bool:
        """Return whether a message with these fields is shown."""
        with _of_filter():
            return bool(self._expression(fields))


@contextlib.contextmanager
def _of_filter() -> Iterator[None]:
    from actionlib_core.inputs.expression import ExpressionError

    try:
        yield
    except ExpressionError as error:
        raise UsageError(f"--filter: {error}") from error


def _nothing(args: argparse.Namespace) -> int:
    which = "message that passes the filter" if args.filter else "message"
    name = args.name.lstrip("/")
    print(f"actionlib: /{name}: no {which} in {args.timeout:g} s", file=sys.stderr)
    return EXIT_FAILED


def _pub(args: argparse.Namespace) -> int:
    from actionlib_core.pubsub.topic import Publisher

    times = 1 if args.once else args.times
    if args.stdin and (args.values or args.rate):
        got = "--rate" if args.rate else repr(args.values)
        raise UsageError(f"topic pub: got {got} beside --stdin; expected one of the two.")
    wanted = args.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if times or args.stdin else 0
    with open_node(args, settle=0.0) as node:
        message_class = typed_class(node, "message", args.type)
        message = message_class.from_yaml(args.values)
        publisher = Publisher(args.name, message_class, latch=args.latch, node=node)
        if publisher.get_num_connections() < wanted:
            print_progress(args, f"Waiting for at least {wanted} matching subscription(s)...")
        if not publisher.wait_for_connections(wanted, args.timeout):
            raise UsageError(
                f"topic {publisher.name}: no {wanted} subscribers in {args.timeout:g} s; there are "
                f"{publisher.get_num_connections()}."
            )
        if args.stdin:
            messages: Iterator[Message] = map(
                message_class.from_yaml, itertools.islice(_documents(), times)
            )
        else:
            print_progress(args, "publisher: beginning loop")
            messages = _at_rate(node.clock, args.rate or 1.0, message, times)
        for number, each in enumerate(messages, 1):
            publisher.publish(each)
            shown = json_text(each.to_dict()) if args.json else f"publishing #{number}: {each!r}\n"
            print(shown, flush=True)
    return 0


def _documents() -> Iterator[str]:
    """Yield the YAML documents of standard input; a line `---` ends one."""
    lines: list[str] = []
    for line in itertools.chain(sys.stdin, ("---",)):
        if line.strip() != "---":
            lines.append(line)
            continue
        if any(text.strip() for text in lines):
            yield "".join(lines)
        lines = []


def _at_rate(clock: Clock, hz: float, message: Message, times: int | None) -> Iterator[Message]:
    """Yield a message again and again, each time when it is due."""
    start = clock.now()
    number = 0
    while times is None or number < times:
        clock.sleep(max(start + number / hz - clock.now(), 0.0))
        yield message
        number += 1
