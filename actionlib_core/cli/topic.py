"""`actionlib topic list|info|type|echo|pub|hz|bw`, with the flags of `ros2 topic`."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import sys
from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.cli import EXIT_FAILED, UsageError
from actionlib_core.cli._ends import ends_by_name, find_ends, only_type, types_of
from actionlib_core.cli._feed import Feed
from actionlib_core.cli._filter import Filter
from actionlib_core.cli._network import open_node
from actionlib_core.cli._numbers import count, rate, seconds, size
from actionlib_core.cli._packages import known
from actionlib_core.presence import Kind, parse_token, token_pattern

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    from actionlib_core.clock import Clock
    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.presence import Endpoint
    from actionlib_core.transport import Closable, Presence, Sample

ENDS = (Kind.PUBLISHER, Kind.SUBSCRIBER)
REPORT_S = 1.0
SHOW_S = 0.5


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
    _register_bw(verbs)


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
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N messages")
    parser.add_argument(
        "--timeout", type=seconds, metavar="S", help="longest wait for a message [s]"
    )
    parser.add_argument(
        "--filter", metavar="EXPR", help="only messages for which this holds: 'data > 3'"
    )
    parser.add_argument("--field", metavar="PATH", help="only this field: pose.position, data[0]")
    parser.add_argument("--csv", action="store_true", help="one line per message")
    parser.add_argument("--json", action="store_true", help="one JSON object per line")
    parser.add_argument("--raw", action="store_true", help="the bytes, undecoded")
    parser.add_argument("--no-arr", action="store_true", help="arrays as their length")
    parser.add_argument("--no-str", action="store_true", help="texts as their length")
    parser.add_argument("--flow-style", action="store_true", help="collections on one line")
    parser.add_argument("-f", "--full-length", action="store_true", help="nothing shortened")
    parser.add_argument(
        "-l", "--truncate-length", type=size, default=128, metavar="N",
        help="shorten arrays and texts to N (default: 128)",
    )  # fmt: skip


def _register_pub(verbs: Any) -> None:
    parser = _add(verbs, "pub", _pub, "publish to a topic")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("type", metavar="TYPE")
    parser.add_argument("values", metavar="YAML", nargs="?", default="", help="'{data: hello}'")
    parser.add_argument("-r", "--rate", type=rate, default=1.0, metavar="HZ", help="default: 1 Hz")
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
    parser.add_argument("--json", action="store_true", help="say what was published as JSON")


def _register_hz(verbs: Any) -> None:
    parser = _add(verbs, "hz", _hz, "print how often messages come")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument(
        "-w", "--window", type=count, default=10_000, metavar="N", help="over the last N messages"
    )
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N reports")
    parser.add_argument("--json", action="store_true", help="one JSON object per report")


def _register_bw(verbs: Any) -> None:
    parser = _add(verbs, "bw", _bw, "print how many bytes come in a second")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument(
        "-w", "--window", type=count, default=100, metavar="N", help="over the last N messages"
    )
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N reports")
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


def _message_class(node: Node, args: argparse.Namespace) -> type[Message]:
    from actionlib_core.interfaces import get_message

    if args.type:
        return known(get_message, args.type)
    ends = find_ends(node, args.name, ENDS, "topic")
    return known(get_message, only_type(ends, args.name, "topic"))


def _echo(args: argparse.Namespace) -> int:
    from actionlib_core.cli._message_text import MessageText
    from actionlib_core.topic import Subscriber

    limit = 1 if args.once else args.count
    wanted = Filter(args.filter) if args.filter else None
    if wanted is not None and args.raw:
        raise UsageError("topic echo: got --filter beside --raw; expected one of the two.")
    with open_node(args) as node, contextlib.ExitStack() as stack:
        feed = Feed(node.clock)
        if args.raw:
            stack.enter_context(
                _listening(node, args.name, lambda sample: feed.put(sample.payload))
            )
            show: Callable[[Any], str] = _raw
        else:
            show = MessageText(args).format
            subscriber = Subscriber(args.name, _message_class(node, args), feed.put, node=node)
            stack.callback(subscriber.unregister)
        shown = 0
        while limit is None or shown < limit:
            deadline = None if args.timeout is None else node.clock.now() + args.timeout
            try:
                item = _next(feed, deadline, wanted)
            except TimeoutError:
                return _nothing(args)
            print(show(item), flush=True)
            shown += 1
    return 0


def _next(feed: Feed, deadline: float | None, wanted: Filter | None) -> Any:
    """Return the next item that is wanted."""
    while True:
        item = feed.next(deadline)
        if wanted is None or wanted(item.to_dict()):
            return item


def _nothing(args: argparse.Namespace) -> int:
    which = "message that passes the filter" if args.filter else "message"
    name = args.name.lstrip("/")
    print(f"actionlib: /{name}: no {which} in {args.timeout:g} s", file=sys.stderr)
    return EXIT_FAILED


def _raw(payload: bytes) -> str:
    return f"{payload!r}\n---"


def _pub(args: argparse.Namespace) -> int:
    from actionlib_core.interfaces import get_message
    from actionlib_core.topic import Publisher

    message_class = known(get_message, args.type)
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


class _Arrival(NamedTuple):
    """When a message came [s], and its size [bytes]."""

    time: float
    size: int


@contextlib.contextmanager
def _listening(node: Node, name: str, callback: Callable[[Sample], None]) -> Iterator[_Ear]:
    """Receive the bytes of a topic, seen by its publishers as a subscriber of their type."""
    ear = _Ear(node, node.resolve(name, "topic name"), callback)
    try:
        yield ear
    finally:
        ear.close()


class _Ear:
    """A subscription whose type is that of the first publisher.

    Publishers that say nothing, or less, while nobody listens need to see it.
    """

    def __init__(self, node: Node, full: str, callback: Callable[[Sample], None]) -> None:
        self._node = node
        self._publishers = Feed(node.clock)
        self._shown = False
        self._parts: list[Closable] = [node.transport.subscribe(full, callback)]
        pattern = token_pattern(Kind.PUBLISHER, full)
        self._parts.append(node.transport.watch_alive(pattern, self._on_presence))

    def show(self, timeout: float) -> None:
        """Let the publishers know, if not done yet.

        Blocks: until there is a publisher, `timeout` [s] at most.
        """
        if self._shown:
            return
        with contextlib.suppress(TimeoutError):
            end: Endpoint = self._publishers.next(self._node.clock.now() + timeout)
            self._parts.append(self._node.announce(Kind.SUBSCRIBER, end.name, end.type, end.md5))
            self._shown = True

    def close(self) -> None:
        """Listen no more."""
        for part in self._parts:
            part.close()

    def _on_presence(self, presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None and presence.alive:
            self._publishers.put(end)


def _measure(args: argparse.Namespace, report: Callable[[list[_Arrival]], None]) -> int:
    """Give `report` the last messages once a second."""
    arrivals: deque[_Arrival] = deque(maxlen=args.window)
    with open_node(args) as node:
        clock = node.clock

        def take(sample: Sample) -> None:
            arrivals.append(_Arrival(clock.now(), len(sample.payload)))

        with _listening(node, args.name, take) as ear:
            fresh = 0.0
            for _ in itertools.count() if args.count is None else range(args.count):
                due = clock.now() + REPORT_S
                ear.show(REPORT_S)
                clock.sleep(max(due - clock.now(), 0.0))
                known = list(arrivals)
                if len(known) > 1 and known[-1].time != fresh:
                    fresh = known[-1].time
                    report(known)
                else:
                    print("no new messages", file=sys.stderr)
    return 0


def _hz(args: argparse.Namespace) -> int:
    return _measure(
        args, lambda known: _print_rate([arrival.time for arrival in known], as_json=args.json)
    )


def _bw(args: argparse.Namespace) -> int:
    return _measure(args, lambda known: _print_bandwidth(known, as_json=args.json))


def _print_bandwidth(known: list[_Arrival], *, as_json: bool) -> None:
    sizes = [arrival.size for arrival in known]
    # The first message ends a gap that was not seen: its bytes belong to the time before.
    speed = sum(sizes[1:]) / max(known[-1].time - known[0].time, 1e-9)
    mean = sum(sizes) / len(sizes)
    if as_json:
        record = {"bytes_per_s": speed, "mean": mean, "min": min(sizes), "max": max(sizes),
                  "window": len(sizes)}  # fmt: skip
        print(json.dumps(record), flush=True)
        return
    print(f"{_bytes(speed)}/s from {len(sizes)} messages")
    print(
        f"\tMessage size mean: {_bytes(mean)} min: {_bytes(min(sizes))} max: {_bytes(max(sizes))}",
        flush=True,
    )


def _bytes(number: float) -> str:
    """Return bytes as `ros2 topic bw` does: `512 B`, `1.50 KB`, `2.00 MB`."""
    for unit, factor in (("MB", 1e6), ("KB", 1e3)):
        if number >= factor:
            return f"{number / factor:.2f} {unit}"
    return f"{number:.0f} B"


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
