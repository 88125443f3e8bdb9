"""`smachpy robot`: runs the simulated robot as a separate program."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.command_line.numbers import between, finite
from actionlib_core.command_line.ros2_options import missing_router, router_endpoint
from actionlib_core.config import Distro, Ros2
from actionlib_core.process.output import printable
from actionlib_core.shutdown.child_process import end_with_stdin
from smachpy.places.exceptions import NavigationError
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.pose import Pose2D, wrap_angle
from smachpy.places.robot_file import SimConfig, load_config

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actionlib_core.node import Node
    from smachpy.sim.nav2 import Nav2Server
    from smachpy.sim.server import RobotServer
    from smachpy.sim.simulation import Simulation
    from smachpy.sim.world import Robot
    from smachpy.sim.world_file import WorldSpec

_MAX_ROBOTS = 1000


def register(subparsers: Any) -> None:
    """Add `smachpy robot`."""
    parser = subparsers.add_parser(
        "robot",
        help="start the simulated robot",
        description="A simulated robot with the actions move_base and charge and the topics odom, "
        "battery, scan and cmd_vel; or a world of several.",
        epilog="Names are changed by a:=b, __ns:=robot_1 or --ros-args.",
    )
    add_robot_options(parser)
    parser.add_argument(
        "--namespace",
        help="prefix of its names, for example robot_1 (default: the configuration's)",
    )
    several = parser.add_mutually_exclusive_group()
    several.add_argument(
        "--world", type=Path, help="a world file, YAML: robots, doors, docks, moving obstacles"
    )
    several.add_argument(
        "--robots",
        type=between(1, _MAX_ROBOTS),
        metavar="N",
        help="N robots in namespaces robot_0, robot_1, ...",
    )
    ros2 = parser.add_argument_group("for ROS 2", "a Nav2 robot on a network of ROS 2 nodes")
    ros2.add_argument(
        "--ros2",
        metavar="ROUTER",
        type=router_endpoint,
        help="offer navigate_to_pose, spin and back_up to ROS 2 nodes behind this Zenoh router, "
        "tcp/127.0.0.1:7447 for example",
    )
    ros2.add_argument(
        "--domain", type=between(0), metavar="N", help="their ROS_DOMAIN_ID (default: 0)"
    )
    ros2.add_argument(
        "--distro",
        choices=get_args(Distro),
        help=f"the release whose message definitions to use (default: {Ros2().distro})",
    )
    parser.add_argument("--parameters", action="store_true", help="list all parameters")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(run=_run, words=())


def add_robot_options(group: Any) -> None:
    """Add the options for the simulated robot and its place."""
    group.add_argument(
        "--map",
        type=Path,
        default=OFFICE_MAP,
        metavar="FILE",
        help="its map, a map_server YAML file (default: the office)",
    )
    group.add_argument(
        "--config", type=Path, default=OFFICE_ROBOT, metavar="FILE", help="its parameters, YAML"
    )
    group.add_argument(
        "--pose",
        type=finite,
        nargs=3,
        metavar=("X", "Y", "YAW"),
        help="where it starts [m, m, rad]",
    )


def _run(args: argparse.Namespace) -> int:
    if args.parameters:
        print(printable(parameters()))
        return 0
    if not args.ros2 and (args.domain is not None or args.distro is not None):
        raise missing_router()
    args.domain = args.domain or 0
    args.distro = args.distro or Ros2().distro
    return serve(args)


def serve(args: argparse.Namespace) -> int:
    """Simulate the robots until SIGINT or SIGTERM; return the exit code.

    A single robot has the namespace of the configuration, unless `args` give one; in a world the
    robots have names of their own.

    Raises:
        InputFileError: the map, the config or the world file has problems.
        NavigationError: a robot cannot stand at its start pose.
        ServerConflictError: there is already a robot of that name.
    """
    from actionlib_core.config import load_config as load_network
    from actionlib_core.node import Node
    from smachpy.sim.nav2 import Nav2Server
    from smachpy.sim.server import RobotServer
    from smachpy.sim.simulation import Simulation

    with shutdown.handle_signals() as ending:
        if args.child:
            current_clock().spawn(lambda: end_with_stdin(ending), name="end with parent")
        alone = args.world is None and not args.robots
        served = make_robot(args.map, args.config, args.pose or ()) if alone else None
        spec = _world(args) if served is None else None
        # `ros2` in the configuration is for missions: the simulated robot joins only the network
        # that --ros2 names.
        config = dataclasses.replace(load_network(), ros2=())
        name, space = ("move_base", config.namespace) if served else ("simulation", "")
        if args.ros2:
            name = "simulated_robot" if served else name
            network = Ros2(router=args.ros2, domain=args.domain, distro=args.distro)
            config = dataclasses.replace(config, ros2=(network,))
        if args.namespace is not None:
            space = args.namespace
        with Node(name, namespace=space, config=config, arguments=args.names) as node:
            server: RobotServer | Simulation | Nav2Server
            if served is not None:
                make = Nav2Server if args.ros2 else RobotServer
                server = make(served, node=node)
            else:
                assert spec is not None
                world = spec.build(current_clock().now())
                server = Simulation(world, node=node, on_ros2=bool(args.ros2))
            try:
                server.start()
                print(printable(_ready(server, node, args)), flush=True)
                forget = ending.on_shutdown(server.close)
                server.wait()
                forget()
            finally:
                server.close()
    return 0


def make_robot(floor: Path, config: Path, pose: Sequence[float]) -> Robot:
    """Return one robot on a floor of its own.

    Args:
        floor: The map.
        config: The robot's parameters.
        pose: The start pose (x, y, yaw) [m, m, rad]; empty: as in the parameters.

    Raises:
        InputFileError: a file has problems.
        NavigationError: the robot cannot stand there.
    """
    from smachpy.places.occupancy import load_map
    from smachpy.sim.world import Robot, World

    parameters, grid = load_config(config), load_map(floor)
    start = Pose2D(pose[0], pose[1], wrap_angle(pose[2])) if pose else parameters.start
    try:
        return Robot(World(grid), parameters, start, current_clock().now())
    except NavigationError as error:
        where = "--pose" if pose else config
        raise NavigationError(f"{where}: {error}. Try --pose X Y YAW.") from error


def team(floor: Path, config: Path, pose: Sequence[float], count: int) -> WorldSpec:
    """Return a world with robots robot_0, robot_1, ...; arguments and errors as in `make_robot`."""
    from smachpy.places.occupancy import load_map
    from smachpy.sim.world_file import WorldSpec, place_robots

    parameters, grid = load_config(config), load_map(floor)
    if pose:
        parameters = dataclasses.replace(parameters, start=Pose2D(*pose))
    return WorldSpec(floor.name, grid, place_robots(grid, parameters, count))


def _world(args: argparse.Namespace) -> WorldSpec:
    from smachpy.sim.world_file import load_world

    if args.world is not None:
        return load_world(args.world)
    return team(args.map, args.config, args.pose or (), args.robots)


def _ready(
    server: RobotServer | Simulation | Nav2Server, node: Node, args: argparse.Namespace
) -> str:
    """Return the line that says what is running."""
    from smachpy.sim.simulation import Simulation

    ros2 = f", ROS 2 {args.distro}, domain {args.domain}" if args.ros2 else ""
    if not isinstance(server, Simulation):
        x, y, _ = server.robot.body.pose
        where = f"{args.map.name} at ({x:.2f}, {y:.2f}){ros2}"
        served = "navigate_to_pose" if args.ros2 else "move_base"
        return f"{node.resolve(served)}: ready on {where}; Ctrl-C ends it"
    floor = args.world.name if args.world else args.map.name
    names = list(server.robots)
    robots = f"{names[0]} to {names[-1]}" if len(names) > 1 else names[0]
    doors = f", doors {', '.join(server.world.doors)}" if server.world.doors else ""
    return f"{node.resolve('simulation')}: ready on {floor}: {robots}{doors}{ros2}; Ctrl-C ends it"


def parameters() -> str:
    """Return all parameters as YAML with their defaults, units and limits."""
    lines = []
    for part in dataclasses.fields(SimConfig):
        default = part.default
        if not dataclasses.is_dataclass(default):
            continue
        lines.append(f"{part.name}:")
        for item in dataclasses.fields(default):
            text = f"  {item.name}: {str(getattr(default, item.name)).lower()}"
            unit, limits = item.metadata.get("unit"), item.metadata.get("limits")
            notes = [f"[{unit}]" if unit else "", limits.text() if limits else ""]
            words = [item.metadata["doc"], "; ".join(note for note in notes if note)]
            lines.append(f"{text:<32}# {' '.join(words).rstrip()}")
    lines += ["start: {x: 0, y: 0, yaw: 0}     # Where it begins, in the map frame. [m, m, rad]"]
    lines += ["dock: {x: 0, y: 0, yaw: 0}      # Where it charges; left out: it has no dock."]
    return "\n".join(lines)
