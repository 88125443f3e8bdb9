"""The simulated robot as a process: `python -m missions.move_base --help`."""

from __future__ import annotations

import argparse
import dataclasses
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.exceptions import ActionlibError
from missions.exceptions import MissionError, NavigationError
from missions.maps import OFFICE_MAP, OFFICE_ROBOT
from missions.move_base.config import SimConfig, load_config
from missions.move_base.geometry import Pose2D, finite, wrap_angle

if TYPE_CHECKING:
    from collections.abc import Sequence

EXIT_BAD_INPUT = 2


def main(argv: Sequence[str] | None = None) -> int:
    """Run the robot until SIGINT or SIGTERM; returns the exit code.

    Blocks: until then.
    """
    args = _parser().parse_args(argv)
    if args.parameters:
        print(parameters())
        return 0
    try:
        return serve(args)
    except (MissionError, ActionlibError) as error:
        if args.debug:
            raise
        print(f"move_base: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT


def serve(args: argparse.Namespace) -> int:
    """Put the robot on the floor and serve it.

    Raises:
        InputFileError: the map or the config is wrong.
        NavigationError: it cannot stand where it should start.
        ServerConflictError: there is a robot of that name already.
    """
    from actionlib_core.node import Node
    from missions.move_base.occupancy import load_map
    from missions.move_base.server import RobotServer
    from missions.move_base.world import Robot, World

    with shutdown.handle_signals() as ending:
        if args.child:
            current_clock().spawn(lambda: _end_with_stdin(ending), name="lifeline")
        config, grid = load_config(args.config), load_map(args.map)
        pose = Pose2D(args.pose[0], args.pose[1], wrap_angle(args.pose[2])) if args.pose else None
        try:
            robot = Robot(World(grid), config, pose or config.start, current_clock().now())
        except NavigationError as error:
            where = "--pose" if pose else args.config
            raise NavigationError(f"{where}: {error}. Try --pose X Y YAW.") from error
        with Node("move_base", namespace=args.namespace) as node:
            server = RobotServer(robot, node=node)
            try:
                server.start()
                x, y, _ = robot.body.pose
                name = node.resolve("move_base")
                where = f"{args.map.name} at ({x:.2f}, {y:.2f})"
                print(f"{name}: ready on {where}; Ctrl-C ends it", flush=True)
                forget = ending.on_shutdown(server.close)
                server.wait()
                forget()
            finally:
                server.close()
    return 0


def parameters() -> str:
    """Return all parameters as the YAML text of their defaults, with unit and limits."""
    lines = []
    for part in dataclasses.fields(SimConfig):
        default = part.default
        if not dataclasses.is_dataclass(default):
            continue
        lines.append(f"{part.name}:")
        for item in dataclasses.fields(default):
            text = f"  {item.name}: {str(getattr(default, item.name)).lower()}"
            if item.metadata:
                unit, limits = item.metadata["unit"], item.metadata["limits"].text()
                notes = "; ".join(note for note in (f"[{unit}]" if unit else "", limits) if note)
                text = f"{text:<32}# {item.metadata['doc']} {notes}"
            lines.append(text)
    lines += ["start: {x: 0, y: 0, yaw: 0}     # Where it begins. [m, m, rad]"]
    lines += ["dock: {x: 0, y: 0, yaw: 0}      # Where it charges; left out: it has no dock."]
    return "\n".join(lines)


def _end_with_stdin(ending: shutdown.Shutdown) -> None:
    """Ask the process to end when nobody holds the other end of its standard input any more."""
    while os.read(sys.stdin.fileno(), 4096):  # not through the buffer: its lock outlives the thread
        pass
    ending.request("the parent has gone")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m missions.move_base",
        description="A simulated robot with the actions move_base and charge and the topics odom "
        "and battery.",
    )
    parser.add_argument("--map", type=Path, default=OFFICE_MAP, help="map_server YAML file")
    parser.add_argument("--config", type=Path, default=OFFICE_ROBOT, help="its parameters, YAML")
    parser.add_argument(
        "--pose",
        type=finite,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="where it starts [m, m, rad]",
    )
    parser.add_argument("--namespace", default="", help="in front of its names, robot_1 say")
    parser.add_argument("--parameters", action="store_true", help="list all parameters and end")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--debug", action="store_true", help="show tracebacks of errors")
    return parser


if __name__ == "__main__":
    sys.exit(main())
