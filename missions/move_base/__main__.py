"""The simulated robot as a process: `python -m missions.move_base --help`."""

from __future__ import annotations

import argparse
import dataclasses
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
from missions.robot_process import end_with_stdin
from smachpy.extras import advice

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.node import Node
    from missions.move_base.server import RobotServer
    from missions.move_base.simulation import Simulation
    from missions.move_base.world import Robot
    from missions.move_base.world_file import WorldSpec

EXIT_BAD_INPUT = 2
_MOST_ROBOTS = 1000


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
    except ModuleNotFoundError as error:
        text = advice(error)
        if args.debug or text is None:
            raise
        print(f"move_base: {text}", file=sys.stderr)
        return EXIT_BAD_INPUT


def serve(args: argparse.Namespace) -> int:
    """Put the robots on the floor and serve them.

    Raises:
        InputFileError: the map, the config or the world file is wrong.
        NavigationError: a robot cannot stand where it should start.
        ServerConflictError: there is a robot of that name already.
    """
    from actionlib_core.node import Node
    from missions.move_base.server import RobotServer
    from missions.move_base.simulation import Simulation

    with shutdown.handle_signals() as ending:
        if args.child:
            current_clock().spawn(lambda: end_with_stdin(ending), name="lifeline")
        served = _one_robot(args) if args.world is None and not args.robots else None
        spec = _world(args) if served is None else None
        with Node("move_base" if served else "simulation", namespace=args.namespace) as node:
            server: RobotServer | Simulation
            if served is not None:
                server = RobotServer(served, node=node)
            else:
                assert spec is not None
                server = Simulation(spec.build(current_clock().now()), node=node)
            try:
                server.start()
                print(_ready(server, node, args), flush=True)
                forget = ending.on_shutdown(server.close)
                server.wait()
                forget()
            finally:
                server.close()
    return 0


def _one_robot(args: argparse.Namespace) -> Robot:
    from missions.move_base.occupancy import load_map
    from missions.move_base.world import Robot, World

    config, grid = load_config(args.config), load_map(args.map)
    pose = Pose2D(args.pose[0], args.pose[1], wrap_angle(args.pose[2])) if args.pose else None
    try:
        return Robot(World(grid), config, pose or config.start, current_clock().now())
    except NavigationError as error:
        where = "--pose" if pose else args.config
        raise NavigationError(f"{where}: {error}. Try --pose X Y YAW.") from error


def _world(args: argparse.Namespace) -> WorldSpec:
    from missions.move_base.occupancy import load_map
    from missions.move_base.world_file import WorldSpec, load_world, place_robots

    if args.world is not None:
        return load_world(args.world)
    config, grid = load_config(args.config), load_map(args.map)
    if args.pose:
        config = dataclasses.replace(config, start=Pose2D(*args.pose))
    return WorldSpec(args.map.name, grid, place_robots(grid, config, args.robots))


def _ready(server: RobotServer | Simulation, node: Node, args: argparse.Namespace) -> str:
    """Return the line that says what is served."""
    from missions.move_base.server import RobotServer

    if isinstance(server, RobotServer):
        x, y, _ = server.robot.body.pose
        where = f"{args.map.name} at ({x:.2f}, {y:.2f})"
        return f"{node.resolve('move_base')}: ready on {where}; Ctrl-C ends it"
    floor = args.world.name if args.world else args.map.name
    names = list(server.robots)
    robots = f"{names[0]} to {names[-1]}" if len(names) > 1 else names[0]
    doors = f", doors {', '.join(server.world.doors)}" if server.world.doors else ""
    return f"{node.resolve('simulation')}: ready on {floor}: {robots}{doors}; Ctrl-C ends it"


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


def _count(text: str) -> int:
    """Read how many robots."""
    if not (text.isdecimal() and 1 <= int(text) <= _MOST_ROBOTS):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected 1 to {_MOST_ROBOTS}")
    return int(text)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m missions.move_base",
        description="A simulated robot with the actions move_base and charge and the topics odom, "
        "battery, scan and cmd_vel; or a world of several.",
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
    several = parser.add_mutually_exclusive_group()
    several.add_argument(
        "--world", type=Path, help="a world file, YAML: robots, doors, docks, moving obstacles"
    )
    several.add_argument(
        "--robots", type=_count, metavar="N", help="N robots in namespaces robot_0, robot_1, ..."
    )
    parser.add_argument("--parameters", action="store_true", help="list all parameters and end")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--debug", action="store_true", help="show tracebacks of errors")
    return parser


if __name__ == "__main__":
    sys.exit(main())
