"""`smachpy run --ros1-robot`: connects a mission to a real robot that runs ROS 1."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from smachpy.exceptions import MissionError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from actionlib_core.ros1 import Ros1Bridge


def add_option(group: Any) -> None:
    """Add the option."""
    group.add_argument(
        "--ros1-robot",
        metavar="URL",
        help="use a real robot that runs ROS 1; URL of its master: http://robot:11311. Only what "
        "the mission uses is carried; see 'smachpy bridge ros1'",
    )


def refuse_simulation(args: argparse.Namespace, option: str) -> None:
    """Check that an option for a real robot was not combined with a simulated one.

    Raises:
        MissionError: it was combined with a simulated robot or virtual time.
    """
    for given, other in (
        (args.start_robot, "--start-robot"),
        (args.time.virtual, f"--time {args.time}"),
        (args.world, "--world"),
    ):
        if given:
            raise MissionError(f"{option}: got {other} beside it; expected one of them.")


@contextlib.contextmanager
def ros1_robot(args: argparse.Namespace) -> Iterator[Ros1Bridge]:
    """Connect the robot to the run's network within the `with` block.

    Raises:
        MissionError: it was combined with a simulated robot or virtual time, or the robot's
            master does not answer within the server timeout.
        Ros1Error: the address cannot be used.

    Blocks: until the master has answered.
    """
    refuse_simulation(args, "--ros1-robot")
    from actionlib_core import ros1

    options: dict[str, Any] = {"namespace": args.robot, "leave_out": _names_of_viewers()}
    with ros1.bridge(args.ros1_robot, on_demand=True, **options) as bridge:
        if not bridge.wait_for_master(args.server_timeout):
            raise MissionError(
                f"--ros1-robot {args.ros1_robot}: no answer of a master at {bridge.master} within "
                f"{args.server_timeout:g} s; expected one. Try 'curl {bridge.master}', or the "
                "address that ROS_MASTER_URI has on the robot."
            )
        yield bridge


def _names_of_viewers() -> list[str]:
    """Return patterns of names that only our viewers use; viewers of ROS 1 get SMACH's topics."""
    from smachpy.network import feed, remote_control, values

    names = (
        *(feed.DESCRIPTION_TOPIC, feed.EVENTS_TOPIC, feed.OBSERVED_TOPIC, feed.HISTORY_SERVICE),
        *(remote_control.STATE_TOPIC, remote_control.CONTROL_SERVICE, values.VALUE_SERVICE),
    )
    return [f"*{name}" for name in names]
