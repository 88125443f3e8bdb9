"""The options `--ros2`, `--domain` and `--distro`, which select a ROS 2 robot, for all commands."""

from __future__ import annotations

import argparse
import contextlib
import os
from typing import TYPE_CHECKING, Any, get_args

from actionlib_core.config import (
    LAST_DOMAIN,
    MAX_DIGITS,
    ROS2_DISTRO_VARIABLE,
    ROS2_DOMAIN_VARIABLE,
    ROS2_VARIABLE,
    Distro,
)
from actionlib_core.exceptions import ConfigError

if TYPE_CHECKING:
    from collections.abc import Iterator


def add_ros2_options(parser: argparse.ArgumentParser, **endpoint: Any) -> None:
    """Add the options to a command.

    Args:
        parser: The command's parser.
        endpoint: Further arguments of `add_argument` for `--ros2`.
    """
    group = parser.add_argument_group("a ROS 2 robot, over rmw_zenoh")
    group.add_argument(
        "--ros2",
        metavar="ENDPOINT",
        type=router_endpoint,
        help="its Zenoh router, tcp/robot.local:7447 for example (default: SMACHPY_ROS2, or the "
        "configuration)",
        **endpoint,
    )
    group.add_argument("--domain", metavar="N", type=_domain, help="its ROS_DOMAIN_ID (default: 0)")
    group.add_argument(
        "--distro",
        metavar="NAME",
        choices=get_args(Distro),
        help=f"its release: {', '.join(get_args(Distro))} (default: jazzy)",
    )


def router_endpoint(text: str) -> str:
    """Return the value of a `--ros2`; its form is checked with the configuration.

    Raises:
        argparse.ArgumentTypeError: it is empty, as with an unset variable of the shell: taken for
            no option at all, it would let a mission drive another robot.
    """
    if not text.strip():
        raise argparse.ArgumentTypeError(
            f"got {text!r}; expected a router, tcp/robot.local:7447 for example"
        )
    return text


def _domain(text: str) -> str:
    if not (text.isascii() and text.isdecimal() and int(text[:MAX_DIGITS]) <= LAST_DOMAIN):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected 0 to {LAST_DOMAIN}")
    return text


def missing_router() -> ConfigError:
    """Return the error for `--domain` or `--distro` without `--ros2`."""
    return ConfigError(
        "command line",
        "--domain and --distro are of a ROS 2 robot: got no --ros2; expected its router. "
        "Try --ros2 tcp/robot.local:7447.",
    )


@contextlib.contextmanager
def ros2_of_options(args: argparse.Namespace) -> Iterator[None]:
    """Apply the options inside the `with` block, through the environment: also in child processes.

    Raises:
        ConfigError: a domain or a release was given without a router.
    """
    given = {
        ROS2_VARIABLE: args.ros2,
        ROS2_DOMAIN_VARIABLE: args.domain,
        ROS2_DISTRO_VARIABLE: args.distro,
    }
    if not (args.ros2 or os.environ.get(ROS2_VARIABLE)) and (args.domain or args.distro):
        raise missing_router()
    before = {name: os.environ.get(name) for name in given}
    os.environ.update({name: value for name, value in given.items() if value})
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
