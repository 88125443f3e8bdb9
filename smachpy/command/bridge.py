"""`smachpy bridge ros1`: real ROS 1 robots, without ROS installed."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from smachpy.sim.geometry import finite

if TYPE_CHECKING:
    from actionlib_core.ros1 import Ros1Bridge

EXIT_ENDED = 1


def register(subparsers: Any) -> None:
    """Add `smachpy bridge`."""
    parser = subparsers.add_parser("bridge", help="reach robots of another kind")
    kinds = parser.add_subparsers(metavar="KIND", required=True, parser_class=type(parser))
    ros1 = kinds.add_parser(
        "ros1",
        help="a robot that runs ROS 1",
        description="Carry actions, topics and services between a ROS 1 robot and this network, "
        "until Ctrl-C. Without names: all actions and services of the robot, and the topics that "
        "programs here use. Exit codes: 0, 1 the robot's master "
        "has ended the bridge, 2 bad input.",
    )
    ros1.add_argument(
        "--master",
        metavar="URL",
        help="of the robot: http://robot:11311 (default: $ROS_MASTER_URI, else this computer's)",
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
        "--used", action="store_true", help="beside names: also what is carried without any"
    )
    ros1.add_argument("--all", action="store_true", help="everything but the log")
    ros1.add_argument(
        "--namespace",
        default="",
        metavar="NAME",
        help="what the robot's names live under here, robot_1 say",
    )
    ros1.add_argument(
        "--host",
        default="",
        metavar="HOST",
        help="under which the robot finds this computer (default: $ROS_HOSTNAME, $ROS_IP, the "
        "address from which its master is reached)",
    )
    ros1.add_argument(
        "--status-timeout",
        type=_seconds,
        default=5.0,
        metavar="S",
        help="an action server of the robot that says nothing for so long is gone [s] "
        "(default: %(default)g)",
    )
    ros1.add_argument("--config", metavar="FILE", help="how to join the network")
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
                print(_ready(bridge, args.namespace), flush=True)
            bridge.wait()
            forget()
    return EXIT_ENDED if bridge.ended else 0


def _ready(bridge: Ros1Bridge, namespace: str) -> str:
    where = f", its names under /{namespace.strip('/')}" if namespace else ""
    return f"{bridge.name}: ready with {bridge.master}{where}; Ctrl-C ends it"


def _split_action(text: str) -> tuple[str, str]:
    name, _, type_name = text.partition(":")
    return name, type_name


def _seconds(text: str) -> float:
    seconds = finite(text)
    if seconds <= 0:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected seconds above 0")
    return seconds
