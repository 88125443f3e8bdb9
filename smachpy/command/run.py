"""`smachpy list` and `smachpy run`."""

from __future__ import annotations

import argparse
import contextlib
import random
import re
import secrets
import sys
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

from actionlib_core.command_line.numbers import seconds
from actionlib_core.command_line.ros2_options import add_ros2_options, ros2_of_options
from actionlib_core.process.output import printable
from smachpy.command.arguments import Text, parameters_of, read_words, usage, wants_help
from smachpy.command.durable import add_options as add_durable_options
from smachpy.command.durable import durable_options, robot_name
from smachpy.command.logs import add_log_options, logging_as
from smachpy.command.queued import add_allow_packages
from smachpy.command.robot import add_robot_options
from smachpy.command.ros1_options import add_options as add_ros1_options
from smachpy.command.ros1_options import options_of
from smachpy.command.ros1_robot import add_option as add_ros1_robot
from smachpy.command.ros1_robot import refuse_simulation, ros1_robot
from smachpy.events.inputs import WHICH
from smachpy.exceptions import MissionError
from smachpy.machines.mission_info import mission_info
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.userdata.secret import MASK, Secret, hides, holds_secret

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import TextIO

    from smachpy.command.evidence import Seal
    from smachpy.command.mission_run import RunOptions
    from smachpy.command.surroundings import Pace, RobotOptions
    from smachpy.command.targets import Target
    from smachpy.machines.container import Container


def register_list(subparsers: Any) -> None:
    """Add `smachpy list`."""
    parser = subparsers.add_parser(
        "list",
        help="list the missions",
        description="List the installed missions, and the mission files and plans in a folder.",
    )
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        default=Path(),
        metavar="FOLDER",
        help="folder of mission files and plans (here)",
    )
    parser.set_defaults(run=_list)


def register(subparsers: Any) -> None:
    """Add `smachpy run`."""
    parser = subparsers.add_parser(
        "run",
        add_help=False,
        help="run a mission",
        usage="smachpy run MISSION [OPTIONS] [-- ARGUMENTS]",
        description="Run a mission to its end and show it in the terminal. Exit codes: 0 it "
        "succeeded, 1 it ended otherwise, 2 bad input; if the mission was preempted: 130 by "
        "Ctrl-C, 143 by SIGTERM.",
        epilog="The words after -- are the arguments of the mission's function: smachpy run "
        "there_and_back -- 4.6 10.6. 'smachpy run MISSION --help' lists them. Names are "
        "remapped with a:=b, __ns:=robot_1 or --ros-args.",
    )
    parser.add_argument(
        "-h", "--help", action=_Help, nargs=0, help="show this, and the mission's arguments"
    )
    parser.add_argument(
        "target",
        metavar="MISSION",
        help="a name of `smachpy list`, module:factory, a .py file, or a plan as .pnml",
    )
    add_input(parser)
    parser.add_argument(
        "--time",
        type=_pace,
        default="real",
        metavar="PACE",
        help="real; virtual: within this process, as fast as possible; 10x: virtual at that rate",
    )
    parser.add_argument(
        "--bag",
        type=Path,
        metavar="FILE",
        help="publish the topics of a bag during the run: .bag, .mcap, or a folder of rosbag2",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write events, pictures and a summary there"
    )
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--plain", action="store_true", help="lines only, for logs")
    shown.add_argument("--json", action="store_true", help="one event per line, as JSON")
    parser.add_argument(
        "--success",
        action="append",
        default=[],
        metavar="OUTCOME",
        help="an outcome that counts as success (default: succeeded)",
    )
    parser.add_argument(
        "--server-timeout",
        type=seconds,
        default=10.0,
        metavar="S",
        help="how long to wait for the mission's action servers [s] (default: %(default)g)",
    )
    _add_watching(parser)
    add_log_options(parser)
    add_durable_options(parser)
    add_ros2_options(parser)
    add_ros1_options(parser, loads=False)
    add_ros1_robot(parser)
    robot = parser.add_argument_group("the simulated robot")
    robot.add_argument(
        "--start-robot",
        action=argparse.BooleanOptionalAction,
        default=False,
        help="start it for this run (default: use a running robot)",
    )
    robot.add_argument(
        "--robot",
        default="",
        metavar="NAME",
        help="the robot to use: its name is the prefix of the mission's names",
    )
    add_robot_options(robot)
    robot.add_argument(
        "--world",
        type=Path,
        metavar="FILE",
        help="a world file instead of map, parameters and pose (default: what the mission needs)",
    )
    robot.add_argument(
        "--share",
        action="store_true",
        help="with robots of its own: use the common network (default: a network of its own, "
        "unless SMACHPY_DOMAIN or SMACHPY_CONFIG names one)",
    )
    # For what rows of a store name; the target on the command line is then only shown.
    parser.add_argument("--queued", action="store_true", help=argparse.SUPPRESS)
    add_allow_packages(parser)
    evidence = parser.add_mutually_exclusive_group()
    add_require_evidence(evidence)
    evidence.add_argument(
        "--evidence",
        action="append",
        default=[],
        metavar="FILE|DIR",
        help="say whether the mission has evidence of 'smachpy certify' here, and run it in any "
        "case (repeatable)",
    )
    parser.set_defaults(run=_run, words=())


def add_require_evidence(parser: argparse._ActionsContainer) -> None:
    """Add the option `--require-evidence`."""
    parser.add_argument(
        "--require-evidence",
        action="append",
        default=[],
        metavar="FILE|DIR",
        help="refuse a mission whose hash has no good evidence of 'smachpy certify' here "
        "(repeatable)",
    )


def _add_watching(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("watching")
    group.add_argument(
        "--view", action="store_true", help="show it in a browser, during the run and after it"
    )
    group.add_argument(
        "--view-for",
        type=time_span,
        metavar="TIME",
        help="how long the page stays after the run: 30s, 10m, 2h, or 0 (default: until Ctrl-C)",
    )
    group.add_argument(
        "--port",
        type=int,
        default=8080,
        help="port of the page; 0 takes any (default: %(default)s)",
    )
    group.add_argument(
        "--control", action="store_true", help="let viewers pause, step, jump and preempt"
    )
    group.add_argument(
        "--autonomy",
        type=int,
        default=0,
        metavar="N",
        help="take the transitions with confirm up to this level without asking (default: "
        "%(default)s)",
    )
    group.add_argument("--record", type=Path, metavar="FILE", help="write the run to a file")
    group.add_argument(
        "--record-inputs",
        choices=WHICH,
        default="seen",
        help="what the file has of answers and messages, to reproduce the run: what the mission "
        "has seen, large messages as hash and summary (default); all of it; none",
    )


def _list(args: argparse.Namespace) -> int:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text as Cell

    from smachpy.command.targets import list_files, list_missions

    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(style="bold")
    table.add_column()
    for name, summary in {**list_missions(), **list_files(args.folder)}.items():
        table.add_row(Cell(printable(name)), Cell(printable(summary)))
    Console(highlight=False).print(table)
    return 0


def _run(args: argparse.Namespace) -> int:
    events = sys.stdout if args.json else None
    with contextlib.ExitStack() as stack:
        if args.queued:
            from smachpy.command.queued import given_back, take_row

            stack.enter_context(given_back(args))
            take_row(args)
        if args.ros2:
            refuse_simulation(args, "--ros2")
        if args.autonomy:
            from smachpy.states.confirming import set_autonomy

            set_autonomy(args.autonomy)
        stack.enter_context(ros2_of_options(args))
        if args.json:  # standard output is for events only: a mission's prints go to standard error
            stack.enter_context(contextlib.redirect_stdout(sys.stderr))
        stack.enter_context(logging_as(args))
        shown = args.time.virtual and args.view
        # Before the mission's module is imported: that may join a network.
        if args.start_robot or shown:
            _use_own_network(args, stack)
        return _run_mission(args, events, stack)


def _use_own_network(args: argparse.Namespace, stack: contextlib.ExitStack) -> None:
    """Give a run with its own robots a domain of its own, unless one was chosen."""
    from actionlib_core.node import has_node
    from actionlib_core.wire.private_network import network_is_chosen, private_network

    alone = args.time.virtual and not args.view
    if not (args.share or alone or network_is_chosen() or has_node()):
        domain = stack.enter_context(private_network())
        print(f"network of this run: SMACHPY_DOMAIN={domain:d}", file=sys.stderr)


def brings_robots(target: Target, words: Sequence[str], inputs: Mapping[str, Text]) -> bool:
    """Return whether a mission starts robots itself when called with these arguments."""
    robots = mission_info(target.thing).robots
    if not isinstance(robots, str):
        return robots
    parameter = parameters_of(target.thing).get(robots)
    if parameter is None:
        raise MissionError(
            f"mission {target.name!r}: robots: got {robots!r}; expected a parameter of it."
        )
    return bool(read_words(target, words, inputs).get(robots, parameter.default))


def _run_mission(
    args: argparse.Namespace, events: TextIO | None, stack: contextlib.ExitStack
) -> int:
    from smachpy.command.mission_run import run_mission
    from smachpy.command.ros1 import run_ros1
    from smachpy.command.targets import load_target

    ros1 = options_of(args)
    robot = None
    if args.ros1_robot is not None and not wants_help(args.words):
        _use_own_network(args, stack)
        robot = stack.enter_context(ros1_robot(args))
    if ros1 is not None:
        if args.input:
            raise MissionError("--input: got --ros1 beside it; expected --params FILE.")
        if args.require_evidence or args.evidence:
            raise MissionError(
                "--require-evidence, --evidence: got --ros1 beside it; expected a mission, as no "
                "script of ROS 1 is certified. Try smachpy port."
            )
        return run_ros1(args.target, ros1, _options(args, {}, None, events), robot)
    target = load_target(args.target, allow=args.allow)
    if args.queued:
        from smachpy.command.queued import check_is_mission

        check_is_mission(target)
    seal = None
    if args.require_evidence or args.evidence:
        from smachpy.command.evidence import check_evidence, find_seal

        places = args.require_evidence or args.evidence
        seal = (check_evidence if args.require_evidence else find_seal)(places, target, args.target)
    if wants_help(args.words):
        print(usage(target))
        return 0
    inputs = read_inputs(args.input)
    if brings_robots(target, args.words, inputs):
        _use_own_network(args, stack)
    origin = _origin(args, target, inputs)
    if args.record is not None or args.view:
        random.seed(origin["seed"])  # a mission that throws dice throws the same ones again
    world = mission_info(target.thing).world
    return run_mission(target, _options(args, inputs, world, events, origin, seal))


def _options(
    args: argparse.Namespace,
    inputs: Mapping[str, Text],
    world: Path | None,
    events: TextIO | None,
    origin: Mapping[str, Any] = MappingProxyType({}),
    seal: Seal | None = None,
) -> RunOptions:
    from smachpy.command.mission_run import RunOptions
    from smachpy.command.watching import Watching

    return RunOptions(
        inputs=inputs,
        words=args.words,
        pace=args.time,
        robot=_robot(args, world),
        names=args.names,
        namespace=robot_name(args.robot) if args.robot else "",
        out=args.out,
        bag=args.bag,
        plain=args.plain,
        events=events,
        success=tuple(args.success),
        server_timeout=args.server_timeout,
        debug=args.debug,
        durable=durable_options(args),
        seal=seal,
        watching=Watching(
            record=args.record,
            inputs=args.record_inputs,
            origin=origin,
            view=args.view,
            view_for=args.view_for,
            port=args.port,
            control=args.control,
            journal=args.durable,
            allow=_allowed(args),
            alone=args.time.virtual,
        ),
    )


def _origin(args: argparse.Namespace, target: Target, inputs: Mapping[str, Text]) -> dict[str, Any]:
    """Return how to begin this mission again, for recordings: without secrets."""
    from smachpy.command.durable import whole_target

    hidden = {
        name
        for name, parameter in parameters_of(target.thing).items()
        if parameter.secret or Secret.__name__ in str(parameter.hint)
    }
    return {
        "target": whole_target(args.target),
        "folder": str(Path.cwd()),
        "words": [MASK if hidden or holds_secret(word) else word for word in args.words],
        "inputs": {
            key: MASK if key in hidden or hides(key, value) or holds_secret(value) else str(value)
            for key, value in inputs.items()
        },
        "names": [f"{rule.old}:={rule.new}" for rule in args.names.rules],
        "robot": args.robot,
        "time": str(args.time),
        "seed": secrets.randbits(32),
    }


def _allowed(args: argparse.Namespace) -> tuple[str, ...]:
    """Return the places whose missions the page of this run may resume: it runs one itself."""
    from smachpy.command.durable import whole_target

    place, _, attribute = whole_target(args.target).partition(":")
    return (*args.allow, place) if attribute or "/" in place else tuple(args.allow)


def _robot(args: argparse.Namespace, world: Path | None) -> RobotOptions:
    """Return what to simulate; `world` is the mission's own, for a run without other options."""
    from smachpy.command.surroundings import RobotOptions

    said = args.pose or args.map != OFFICE_MAP or args.config != OFFICE_ROBOT
    if args.world is not None and said:
        raise MissionError(
            "--world: got --map, --config or --pose beside it; expected it alone, as the file says "
            "all of that."
        )
    pose = tuple(args.pose or ())
    world = args.world or (None if said else world)
    ros1 = args.ros1_robot or ""
    return RobotOptions(args.start_robot, args.map, args.config, pose, world, ros1)


class _Help(argparse.Action):
    """Prints the options, and the arguments of the mission that was named before."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> NoReturn:
        """Print and exit."""
        del values, option_string
        parser.print_help()
        name = getattr(namespace, "target", None)
        if name is not None:
            from smachpy.command.targets import load_target

            print(f"\n{usage(load_target(name))}")
        parser.exit()


def time_span(text: str) -> float:
    """Return the seconds of "30s", "10m", "2h" or "0", for argparse."""
    match = re.fullmatch(r"(\d{1,9}(?:\.\d{1,3})?)(s|m|h|)", text)
    if match is None:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected a time such as 30s, 10m, 2h or 0")
    return float(match[1]) * {"": 1, "s": 1, "m": 60, "h": 3600}[match[2]]


def _pace(text: str) -> Pace:
    from smachpy.command.surroundings import Pace

    try:
        return Pace.read(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def add_input(parser: argparse.ArgumentParser) -> None:
    """Add the option `--input`; `read_inputs` reads its values."""
    parser.add_argument(
        "--input",
        "-i",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        type=read_input,
        help="an argument of the mission's function by name, or a userdata key",
    )


def built_to_look(target: Target, args: argparse.Namespace) -> Container:
    """Return a machine that is only looked at, with the arguments of `--input`, if there are any.

    Raises:
        MissionError, TargetError: it cannot be made.
    """
    from smachpy.command.mission_run import build

    inputs = read_inputs(args.input)
    return build(target, inputs, to_run=False) if inputs else target.build()


def read_inputs(pairs: Sequence[tuple[str, Text]]) -> dict[str, Text]:
    """Return the values of `--input` by key; a key must not be given twice."""
    inputs = dict(pairs)
    if len(inputs) < len(pairs):
        twice = next(key for key, _ in pairs if sum(key == other for other, _ in pairs) > 1)
        raise MissionError(f"--input {twice}: given twice; expected once.")
    return inputs


def read_input(text: str) -> tuple[str, Text]:
    """Read KEY=VALUE."""
    key, equals, value = text.partition("=")
    if not (key and equals):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected KEY=VALUE")
    return key, Text(value)
