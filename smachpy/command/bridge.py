"""`smachpy bridge ros1`: connects real ROS 1 robots, without ROS installed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.command_line.numbers import seconds
from actionlib_core.process.output import printable

if TYPE_CHECKING:
    import argparse

    from actionlib_core.ros1 import Ros1Bridge

EXIT_ENDED = 1


def register(subparsers: Any) -> None:
    """Add `smachpy bridge`."""
    parser = subparsers.add_parser("bridge", help="connect robots that use another middleware")
    kinds = parser.add_subparsers(metavar="KIND", required=True, parser_class=type(parser))
    ros1 = kinds.add_parser(
        "ros1",
        help="a robot that runs ROS 1",
        description="Carry actions, topics and services between a ROS 1 robot and this network, "
        "until Ctrl-C. Without names: all actions and services of the robot, and the topics that "
        "programs here use. Exit codes: 0, 1 the robot's master "
        "ended the bridge, 2 bad input.",
    )
    ros1.add_argument(
        "--master",
        metavar="URL",
        help="the robot's master: http://robot:11311 (default: $ROS_MASTER_URI or this computer)",
    )
    names = (
        ("--action", "NAME[:TYPE]", "an action: move_base:move_base_msgs/MoveBaseAction"),
        ("--topic", "NAME", "a topic; its type is learned"),
        ("--service", "NAME", "a service; its type is learned"),
    )
    for option, metavar, text in names:
        ros1.add_argument(
            option, action="append", default=[], metavar=metavar, help=f"{text} (repeatable)"
        )
    ros1.add_argument(
        "--used", action="store_true", help="in addition to given names: the default without names"
    )
    ros1.add_argument("--all", action="store_true", help="everything except the log")
    ros1.add_argument(
        "--namespace",
        default="",
        metavar="NAME",
        help="prefix of the robot's names here, for example robot_1",
    )
    ros1.add_argument(
        "--host",
        default="",
        metavar="HOST",
        help="the name or address of this computer for the robot (default: $ROS_HOSTNAME, $ROS_IP, "
        "the address from which its master is reached)",
    )
    ros1.add_argument(
        "--status-timeout",
        type=seconds,
        default=5.0,
        metavar="S",
        help="an action server of the robot that is silent for this long is gone [s] "
        "(default: %(default)g)",
    )
    ros1.add_argument("--config", metavar="FILE", help="network configuration")
    ros1.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    from actionlib_core import ros1, shutdown

    named = bool(args.action or args.topic or args.service)
    with shutdown.handle_signals() as ending:
        bridge = ros1.bridge(
            args.master,
            actions=dict(_split_action(text) for text in args.action),
            topics=args.topic,
            services=args.service,
            used=args.used or not (named or args.all),
            all=args.all,
            namespace=args.namespace,
            host=args.host,
            status_timeout=args.status_timeout,
            config=args.config,
        )
        with bridge:
            forget = ending.on_shutdown(bridge.close)
            if bridge.wait_for_master():
                print(printable(_ready(bridge, args.namespace)), flush=True)
            bridge.wait()
            forget()
    return EXIT_ENDED if bridge.ended else 0


def _ready(bridge: Ros1Bridge, namespace: str) -> str:
    where = f", its names under /{namespace.strip('/')}" if namespace else ""
    return f"{bridge.name}: ready with {bridge.master}{where}; Ctrl-C ends it"


def _split_action(text: str) -> tuple[str, str]:
    name, _, type_name = text.partition(":")
    return name, type_name
