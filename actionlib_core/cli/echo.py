"""`actionlib echo`: print the messages of an action."""

from __future__ import annotations

import itertools
import logging
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED
from actionlib_core.cli._command import add_command, print_json, print_message
from actionlib_core.cli._feed import Feed
from actionlib_core.cli._network import class_of_end, find_server, open_node
from actionlib_core.cli._ros2 import RemoteAction, is_ros2
from actionlib_core.command_line.numbers import count, seconds
from actionlib_core.exceptions import DeserializationError
from actionlib_core.process.output import tell

if TYPE_CHECKING:
    import argparse

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.transport.tokens import Endpoint
    from actionlib_core.wire.arrivals import Readable

log = logging.getLogger(__name__)


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = add_command(
        subparsers, "echo", run, "print goals, feedback and results as they are sent"
    )
    parser.add_argument("name", metavar="NAME", help="the action")
    parser.add_argument("-s", "--status", action="store_true", help="also the status lists")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("-n", "--count", type=count, metavar="N", help="end after N messages")
    parser.add_argument("--timeout", type=seconds, metavar="S", help="end after this time [s]")


def run(args: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, `--timeout` or, with `--once` or `-n`, enough of them."""
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatusArray
    from actionlib_core.wire.actions import action_keys
    from actionlib_core.wire.arrivals import Readable

    with open_node(args, settle=0.0) as node:
        server = find_server(node, args.name, args.timeout)
        if is_ros2(server.type):
            return _echo_ros2(node, server, args)
        example = class_of_end(node, server)()
        keys = action_keys(server.name)
        classes = {
            keys.goal: type(example.action_goal),
            keys.cancel: GoalID,
            keys.feedback: type(example.action_feedback),
            keys.result: type(example.action_result),
        }
        if args.status:
            classes[keys.status] = GoalStatusArray
        feed, readable = Feed(node.clock), Readable(log)
        subscriptions = [
            node.transport.subscribe(key, partial(_put, feed, readable, message_class))
            for key, message_class in classes.items()
        ]
        return _show_all(node, feed, subscriptions, args)


def _echo_ros2(node: Node, server: Endpoint, args: argparse.Namespace) -> int:
    """Print feedback and statuses; in ROS 2, goals and results go to one receiver only."""
    action, feed = RemoteAction(node, server), Feed(node.clock)

    def subscribe(part: str) -> Closable:
        message_class = getattr(action.parts, part).message
        return action.subscribe(
            part, lambda sample: feed.put((part, message_class, sample.payload), _size)
        )

    subscriptions = [subscribe(part) for part in ("feedback", "status")[: 1 + args.status]]
    return _show_all(node, feed, subscriptions, args)


def _show_all(
    node: Node, feed: Feed, subscriptions: list[Closable], args: argparse.Namespace
) -> int:
    deadline = None if args.timeout is None else node.clock.now() + args.timeout
    limit = 1 if args.once else args.count
    unreadable: set[str] = set()  # the parts of the action of which this was told
    try:
        for _ in itertools.count() if limit is None else range(limit):
            _show_next(feed, deadline, unreadable, as_json=args.json)
    except TimeoutError:
        return 0 if limit is None else _too_few(args)
    finally:
        for subscription in subscriptions:
            subscription.close()
    return 0


def _too_few(args: argparse.Namespace) -> int:
    print(f"actionlib: /{args.name.lstrip('/')}: not enough in {args.timeout:g} s", file=sys.stderr)
    return EXIT_FAILED


def _put(feed: Feed, readable: Readable, message_class: Any, sample: Sample) -> None:
    if readable.check(sample, message_class):
        feed.put((sample.key.rpartition("/")[2], message_class, sample.payload), _size)


def _size(item: tuple[str, Any, bytes]) -> int:
    return len(item[2])


def _show_next(feed: Feed, deadline: float | None, unreadable: set[str], *, as_json: bool) -> None:
    """Print the next message. Those that cannot be read are dropped, and the first one is told."""
    while True:
        word, message_class, payload = feed.next(deadline)
        try:
            message = message_class.from_bytes(payload)
        except DeserializationError as error:
            if word not in unreadable:
                unreadable.add(word)
                tell("actionlib", f"{word}: a message cannot be read: {error}")
            continue
        if as_json:
            print_json(topic=word, message=message.to_dict())
        else:
            print_message(f"{word}:", message)
        return
