"""`actionlib topic hz|bw`: the rate of a topic's messages, in messages and in bytes."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import sys
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.cli._command import add_command
from actionlib_core.cli._network import open_node
from actionlib_core.cli._ros2 import subscribe_to_bytes
from actionlib_core.command_line.numbers import count
from actionlib_core.transport.tokens import Kind, parse_token, token_pattern

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, Sample

REPORT_S = 1.0  # interval of the reports


class _Arrival(NamedTuple):
    """The time [s] and size [bytes] of a received message."""

    time: float
    size: int


def register(verbs: Any) -> None:
    """Add the commands to an argparse subparsers object."""
    for name, show, help_, window in (
        ("hz", _show_rate, "print the rate of messages", 10_000),
        ("bw", _show_bandwidth, "print the bytes per second", 100),
    ):
        parser = add_command(verbs, name, partial(_measure, show), help_)
        parser.add_argument("name", metavar="NAME")
        parser.add_argument(
            "-w",
            "--window",
            type=count,
            default=window,
            metavar="N",
            help="of the last N messages",
        )
        parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N reports")


@contextlib.contextmanager
def listening(node: Node, name: str, callback: Callable[[Sample], None]) -> Iterator[None]:
    """Receive the bytes of a topic, and announce a subscriber with the first publisher's type.

    Some publishers send less, or nothing, as long as they see no subscriber.
    """
    full = node.resolve(name, "topic name")
    announced: list[Closable] = []

    def on_presence(presence: Presence) -> None:
        end = parse_token(presence.key)
        if end is not None and presence.alive and not announced:
            announced.append(node.announce(Kind.SUBSCRIBER, end.name, end.type, end.md5))

    subscriptions = [
        node.transport.subscribe(full, callback),
        *subscribe_to_bytes(node, full, callback),
    ]
    watch = node.transport.watch_alive(token_pattern(Kind.PUBLISHER, full), on_presence)
    try:
        yield
    finally:
        for part in (watch, *subscriptions, *announced):
            part.close()


def _measure(show: Callable[[list[_Arrival]], tuple[Any, str]], args: argparse.Namespace) -> int:
    """Print a report about the last messages every `REPORT_S`."""
    arrivals: deque[_Arrival] = deque(maxlen=args.window)
    with open_node(args) as node:
        clock = node.clock

        def take(sample: Sample) -> None:
            arrivals.append(_Arrival(clock.now(), len(sample.payload)))

        with listening(node, args.name, take):
            fresh = 0.0
            for _ in itertools.count() if args.count is None else range(args.count):
                clock.sleep(REPORT_S)
                known = list(arrivals)
                if len(known) > 1 and known[-1].time != fresh:
                    fresh = known[-1].time
                    record, text = show(known)
                    print(json.dumps(record) if args.json else text, flush=True)
                else:
                    print("no new messages", file=sys.stderr)
    return 0


def _show_rate(known: list[_Arrival]) -> tuple[dict[str, float], str]:
    gaps = [later.time - earlier.time for earlier, later in itertools.pairwise(known)]
    mean = sum(gaps) / len(gaps)
    spread = math.sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps))
    rate = 1.0 / mean if mean else math.inf
    record = {"rate_hz": rate, "min_s": min(gaps), "max_s": max(gaps), "std_dev_s": spread}
    text = (
        f"average rate: {rate:.3f}\n\tmin: {min(gaps):.3f}s max: {max(gaps):.3f}s "
        f"std dev: {spread:.5f}s window: {len(known)}"
    )
    return {**record, "window": len(known)}, text


def _show_bandwidth(known: list[_Arrival]) -> tuple[dict[str, float], str]:
    sizes = [arrival.size for arrival in known]
    # Without the first message: its bytes belong to the time before it.
    speed = sum(sizes[1:]) / max(known[-1].time - known[0].time, 1e-9)
    mean, low, high = sum(sizes) / len(sizes), min(sizes), max(sizes)
    record = {"bytes_per_s": speed, "mean": mean, "min": low, "max": high, "window": len(sizes)}
    text = (
        f"{_bytes(speed)}/s from {len(sizes)} messages\n"
        f"\tMessage size mean: {_bytes(mean)} min: {_bytes(low)} max: {_bytes(high)}"
    )
    return record, text


def _bytes(number: float) -> str:
    """Return bytes as `ros2 topic bw` does: `512 B`, `1.50 KB`, `2.00 MB`."""
    for unit, factor in (("MB", 1e6), ("KB", 1e3)):
        if number >= factor:
            return f"{number / factor:.2f} {unit}"
    return f"{number:.0f} B"
