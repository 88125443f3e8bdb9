"""`actionlib echo`: print what goes over an action's keys."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._network import action_class, open_node, wait_for_server
from actionlib_core.cli._output import add_json, print_json, print_message

if TYPE_CHECKING:
    import argparse

    from actionlib_core.transport import Sample


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser("echo", help="print goals, feedback and results as they pass")
    parser.add_argument("name", metavar="NAME", help="the action")
    parser.add_argument("-s", "--status", action="store_true", help="also the status lists")
    parser.add_argument("--once", action="store_true", help="end after the first message")
    parser.add_argument("--timeout", type=float, metavar="S", help="end after this time [s]")
    add_json(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, `--timeout` or, with `--once`, the first."""
    from actionlib_core._action_wire import action_keys
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatusArray

    with open_node(args, settle=0.0) as node:
        server = wait_for_server(node, args.name, args.timeout)
        example = action_class(server.type)()
        keys = action_keys(server.name)
        classes = {
            keys.goal: type(example.action_goal),
            keys.cancel: GoalID,
            keys.feedback: type(example.action_feedback),
            keys.result: type(example.action_result),
        }
        if args.status:
            classes[keys.status] = GoalStatusArray
        seen = node.clock.event()
        subscriptions = [
            node.transport.subscribe(
                key, partial(_show, key.rpartition("/")[2], message_class, args, seen)
            )
            for key, message_class in classes.items()
        ]
        try:
            if args.once:
                seen.wait(args.timeout)
            else:
                node.clock.event().wait(args.timeout)
        finally:
            for subscription in subscriptions:
                subscription.close()
    return 0


def _show(
    word: str, message_class: Any, args: argparse.Namespace, seen: Any, sample: Sample
) -> None:
    if args.once and seen.is_set():
        return
    message = message_class.from_bytes(sample.payload)
    if args.json:
        print_json(topic=word, message=message.to_dict())
    else:
        print_message(f"{word}:", message)
    seen.set()
