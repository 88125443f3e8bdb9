"""`actionlib topic list|info|type|echo|pub|hz`, with the flags of `ros2 topic`."""

from __future__ import annotations

import itertools
import json
import math
import sys
from collections import deque
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import UsageError
from actionlib_core.cli._ends import ends_by_name, find_ends, only_type, types_of
from actionlib_core.cli._network import open_node
from actionlib_core.presence import Kind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint

ENDS = (Kind.PUBLISHER, Kind.SUBSCRIBER)


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser("topic", help="list, watch and publish topics")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    _register_list(verbs)
    _register_info(verbs)
    _register_type(verbs)
    _register_echo(verbs)
    _register_pub(verbs)
    _register_hz(verbs)


def _add(verbs: Any, name: str, run: Callable[[argparse.Namespace], int], help_: str) -> Any:
    parser = verbs.add_parser(name, help=help_)
    parser.set_defaults(run=run)
    return parser


def _register_list(verbs: Any) -> None:
    parser = _add(verbs, "list", _list, "list the topics there are")
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument("-c", "--count-topics", action="store_true", help="only how many")
    parser.add_argument("-v", "--verbose", action="store_true", help="with publishers, subscribers")
    parser.add_argument("--json", action="store_true", help="as JSON")


def _register_info(verbs: Any) -> None:
    parser = _add(verbs, "info", _info, "who publishes and subscribes")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("-v", "--verbose", action="store_true", help="with nodes and checksums")
    parser.add_argument("--json", action="store_true", help="as JSON")


def _register_type(verbs: Any) -> None:
    parser = _add(verbs, "type", _type, "print the type of a topic")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("--json", action="store_true", help="as JSON")


def _register_echo(verbs: Any) -> None:
    parser = _add(verbs, "echo", _echo, "print the messages of a topic")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("type", metavar="TYPE", nargs="?", help="default: what its ends say")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("-n", "--count", type=int, metavar="N", help="end after N messages")
    parser.add_argument("--timeout", type=float, metavar="S", help="longest wait for a message [s]")
    parser.add_argument("--field", metavar="PATH", help="only this field: pose.position, data[0]")
    parser.add_argument("--csv", action="store_true", help="one line per message")
    parser.add_argument("--json", action="store_true", help="one JSON object per line")
    parser.add_argument("--raw", action="store_true", help="the bytes, undecoded")
    parser.add_argument("--no-arr", action="store_true", help="arrays as their length")
    parser.add_argument("--no-str", action="store_true", help="texts as their length")
    parser.add_argument("--flow-style", action="store_true", help="collections on one line")
    parser.add_argument("-f", "--full-length", action="store_true", help="nothing shortened")
    parser.add_argument(
        "-l", "--truncate-length", type=int, default=128, metavar="N",
        help="shorten arrays and texts to N (default: 128)",
    )  # fmt: skip


def _register_pub(verbs: Any) -> None:
    parser = _add(verbs, "pub", _pub, "publish to a topic")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("type", metavar="TYPE")
    parser.add_argument("values", metavar="YAML", nargs="?", default="", help="'{data: hello}'")
    parser.add_argument("-r", "--rate", type=float, default=1.0, metavar="HZ", help="default: 1 Hz")
    parser.add_argument("-1", "--once", action="store_true", help="one message, then end")
    parser.add_argument("-t", "--times", type=int, metavar="N", help="N messages, then end")
    parser.add_argument(
        "-w", "--wait-matching-subscriptions", type=int, metavar="N",
        help="wait for N subscribers (default: 1 with --once and --times, else 0)",
    )  # fmt: skip
    parser.add_argument("--timeout", type=float, metavar="S", help="longest wait for them [s]")
    parser.add_argument("--latch", action="store_true", help="keep it for late subscribers")
    parser.add_argument(
        "--stdin", action="store_true", help="one message per YAML document from standard input"
    )
    parser.add_argument("--json", action="store_true", help="say what was published as JSON")


def _register_hz(verbs: Any) -> None:
    parser = _add(verbs, "hz", _hz, "print how often messages come")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument(
        "-w", "--window", type=int, default=10_000, metavar="N", help="over the last N messages"
    )
    parser.add_argument("-n", "--count", type=int, metavar="N", help="end after N reports")
    parser.add_argument("--json", action="store_true", help="one JSON object per report")


# -- who is there ----------------------------------------------------------------------------------


def _list(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        topics = ends_by_name(node, ENDS)
    if args.json:
        print(json.dumps([_record(name, ends) for name, ends in topics.items()]))
    elif args.count_topics:
        print(len(topics))
    elif args.verbose:
        _print_by_direction(topics)
    else:
        for name, ends in topics.items():
            print(f"/{name} [{_types(ends)}]" if args.show_types else f"/{name}")
    return 0


def _print_by_direction(topics: dict[str, list[Endpoint]]) -> None:
    for title, kind in (("Published", Kind.PUBLISHER), ("Subscribed", Kind.SUBSCRIBER)):
        print(f"{title} topics:")
        for name, ends in topics.items():
            count = _count(ends, kind)
            if count:
                plural = "" if count == 1 else "s"
                print(f" * /{name} [{_types(ends)}] {count} {kind.value}{plural}")
        print()


def _types(ends: list[Endpoint]) -> str:
    return ", ".join(types_of(ends, "msg"))


def _count(ends: list[Endpoint], kind: Kind) -> int:
    return sum(end.kind is kind for end in ends)


def _record(name: str, ends: list[Endpoint]) -> dict[str, Any]:
    return {
        "name": f"/{name}",
        "types": types_of(ends, "msg"),
        "publishers": [f"/{end.node}" for end in ends if end.kind is Kind.PUBLISHER],
        "subscribers": [f"/{end.node}" for end in ends if end.kind is Kind.SUBSCRIBER],
    }


def _info(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name, ENDS, "topic")
    if args.json:
        print(json.dumps(_record(ends[0].name, ends)))
        return 0
    print(f"Type: {_types(ends)}")
    for title, kind in (("Publisher", Kind.PUBLISHER), ("Subscription", Kind.SUBSCRIBER)):
        print(f"{title} count: {_count(ends, kind)}")
        for end in ends if args.verbose else ():
            if end.kind is kind:
                print(f"  Node: /{end.node}  type: {end.type}  md5: {end.md5}")
    return 0


def _type(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name, ENDS, "topic")
    types = types_of(ends, "msg")
    if args.json:
        print(json.dumps(types))
    else:
        print("\n".join(types))
    return 0


# -- messages --------------------------------------------------------------------------------------


class _Feed:
    """Hands what callbacks bring to the main thread, which prints it and gets the Ctrl-C."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._items: deque[Any] = deque()
        self._changed = clock.event()

    def put(self, item: Any) -> None:
        self._items.append(item)
        self._changed.set()

    def take(self, timeout: float | None) -> Iterator[Any]:
        """Yield what comes, until nothing has come for `timeout` [s]."""
        while True:
            self._changed.clear()
            while self._items:
                yield self._items.popleft()
            if not self._changed.wait(timeout):
                return


def _message_class(node: Node, args: argparse.Namespace) -> type[Message]:
    from actionlib_core.interfaces import get_message

    if args.type:
        return get_message(args.type)
    ends = find_ends(node, args.name, ENDS, "topic")
    return get_message(only_type(ends, args.name, "topic"))


def _echo(args: argparse.Namespace) -> int:
    from actionlib_core.cli._message_text import MessageText
    from actionlib_core.topic import Subscriber

    limit = 1 if args.once else args.count
    with open_node(args) as node:
        feed = _Feed(node.clock)
        if args.raw:
            name = node.resolve(args.name, "topic name")
            node.transport.subscribe(name, lambda sample: feed.put(sample.payload))
            show: Callable[[Any], str] = _raw
        else:
            show = MessageText(args).format
            Subscriber(args.name, _message_class(node, args), feed.put, node=node)
        for number, item in enumerate(feed.take(args.timeout), 1):
            print(show(item), flush=True)
            if number == limit:
                return 0
    print(f"actionlib: /{args.name.lstrip('/')}: no message in {args.timeout:g} s", file=sys.stderr)
    return 1


def _raw(payload: bytes) -> str:
    return f"{payload!r}\n---"


def _pub(args: argparse.Namespace) -> int:
    from actionlib_core.interfaces import get_message
    from actionlib_core.topic import Publisher

    message_class = get_message(args.type)
    times = 1 if args.once else args.times
    wanted = args.wait_matching_subscriptions
    if wanted is None:
        wanted = 1 if times or args.stdin else 0
    texts = _documents() if args.stdin else None
    message = message_class.from_yaml(args.values)
    with open_node(args, settle=0.0) as node:
        publisher = Publisher(args.name, message_class, latch=args.latch, node=node)
        if publisher.get_num_connections() < wanted:
            _note(args, f"Waiting for at least {wanted} matching subscription(s)...")
        if not publisher.wait_for_connections(wanted, args.timeout):
            raise UsageError(
                f"topic {publisher.name}: no {wanted} subscribers in {args.timeout:g} s; there are "
                f"{publisher.get_num_connections()}."
            )
        if texts is not None:
            messages: Iterator[Message] = (message_class.from_yaml(text) for text in texts)
            _publish_all(args, publisher.publish, messages)
        else:
            _note(args, "publisher: beginning loop")
            _publish_at_rate(args, node.clock, publisher.publish, message, times)
    return 0


def _note(args: argparse.Namespace, text: str) -> None:
    if not args.json:
        print(text, flush=True)


def _told(args: argparse.Namespace, number: int, message: Message) -> None:
    if args.json:
        print(json.dumps(message.to_dict()), flush=True)
    else:
        print(f"publishing #{number}: {message!r}\n", flush=True)


def _documents() -> Iterator[str]:
    """Yield the YAML documents of standard input; a line `---` ends one."""
    lines: list[str] = []
    for line in sys.stdin:
        if line.strip() == "---":
            if any(text.strip() for text in lines):
                yield "".join(lines)
            lines = []
        else:
            lines.append(line)
    if any(text.strip() for text in lines):
        yield "".join(lines)


def _publish_all(
    args: argparse.Namespace, publish: Callable[[Message], None], messages: Iterator[Message]
) -> None:
    for number, message in enumerate(messages, 1):
        publish(message)
        _told(args, number, message)


def _publish_at_rate(
    args: argparse.Namespace,
    clock: Clock,
    publish: Callable[[Message], None],
    message: Message,
    times: int | None,
) -> None:
    period = 1.0 / args.rate
    start = clock.now()
    number = 0
    while times is None or number < times:
        number += 1
        publish(message)
        _told(args, number, message)
        if number != times:
            clock.sleep(max(start + number * period - clock.now(), 0.0))


# -- rates -----------------------------------------------------------------------------------------


def _hz(args: argparse.Namespace) -> int:
    reports = 0
    with open_node(args, settle=0.0) as node:
        clock = node.clock
        times: deque[float] = deque(maxlen=args.window)
        name = node.resolve(args.name, "topic name")
        node.transport.subscribe(name, lambda _: times.append(clock.now()), history=False)
        fresh = 0.0
        while args.count is None or reports < args.count:
            clock.sleep(1.0)
            stamps = list(times)
            if len(stamps) > 1 and stamps[-1] != fresh:
                fresh = stamps[-1]
                _print_rate(stamps, as_json=args.json)
            else:
                print("no new messages", file=sys.stderr)
            reports += 1
    return 0


def _print_rate(stamps: list[float], *, as_json: bool) -> None:
    gaps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    mean = sum(gaps) / len(gaps)
    spread = math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
    rate = 1.0 / mean if mean else math.inf
    if as_json:
        record = {"rate_hz": rate, "min_s": min(gaps), "max_s": max(gaps), "std_dev_s": spread,
                  "window": len(stamps)}  # fmt: skip
        print(json.dumps(record), flush=True)
        return
    print(f"average rate: {rate:.3f}")
    print(
        f"\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s std dev: {spread:.5f}s "
        f"window: {len(stamps)}",
        flush=True,
    )
