"""`smachpy explore`: runs a mission with all that can happen, with doubles for its states."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core.command_line.numbers import between, seconds
from actionlib_core.process.output import printable
from smachpy.command.durable import whole_target
from smachpy.command.on import ProgressLine, add_jobs_and_on, opened_cluster, workers_text
from smachpy.command.run import add_input, brings_robots, read_inputs
from smachpy.exceptions import MissionError
from smachpy.machines.container import Container
from smachpy.machines.mission_info import mission_info

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from smachpy.command.arguments import Text
    from smachpy.command.targets import Target

EXAMPLES = """examples:
  smachpy explore patrol.yaml
  smachpy explore my_mission.py --fault raise --fault deaf --max-runs 5000
"""


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "explore",
        help="run a mission with every outcome of its states",
        description="Run a mission with doubles in the places of its states: with every "
        "combination of outcomes, a preempt during each state, every order of parallel ones. No "
        "robot is needed, and no code is run that a mission file names. Exit codes: 0 nothing "
        "found, 1 a run breaks an invariant (it ends, raises nothing, ends soon after a preempt), "
        "2 bad input.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("target", metavar="MISSION", help="as for `smachpy run`")
    add_input(parser)
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        choices=("hang", "raise", "deaf", "kill"),
        help="states may hang, raise or ignore a preempt, or the process is killed (repeatable)",
    )
    parser.add_argument(
        "--max-runs",
        type=between(1),
        default=1_000,
        metavar="N",
        help="the most runs (default: %(default)s)",
    )
    parser.add_argument(
        "--max-time",
        type=seconds,
        default=60.0,
        metavar="S",
        help="the longest time [s] (default: %(default)g)",
    )
    add_jobs_and_on(parser)
    parser.add_argument(
        "--pictures", type=Path, metavar="FOLDER", help="draw the run that breaks an invariant"
    )
    parser.set_defaults(run=run, words=())


def run(args: argparse.Namespace) -> int:
    """Explore the mission; return 1 if a run breaks an invariant."""
    from smachpy.testing.exploring.exploration import explore

    target = args.target if args.on is None else whole_target(args.target)
    make = MissionMaker(target, read_inputs(args.input), args.words)
    make.check()
    machine = make()
    with opened_cluster(args.on, target) as cluster:
        progress = ProgressLine("runs", workers_text(cluster, args.jobs, args.max_runs))
        try:
            found = explore(
                make,
                max_runs=args.max_runs,
                max_time=args.max_time,
                faults=args.fault,
                keep=reckoning_states(machine),
                folder=None if args.pictures is None else lambda: args.pictures,
                jobs=args.jobs,
                cluster=cluster,
                progress=progress.show,
            )
        finally:
            progress.end()
    print(printable(f"/{machine.name or args.target}: {found}"))
    return 0 if found.ok else 1


@dataclass(frozen=True, slots=True)
class MissionMaker:
    """Makes the machine of a mission, here and in other processes.

    Attributes:
        target: The mission, as for `smachpy run`.
        inputs: Its arguments by name.
        words: Its arguments in order.
        imports, allow: As for `load_target`.
    """

    target: str
    inputs: Mapping[str, Text]
    words: tuple[str, ...] = ()
    imports: bool = False
    allow: tuple[str, ...] | None = None

    def check(self) -> None:
        """Refuse a mission that starts its robots, in each run anew.

        Raises:
            MissionError: it does.
        """
        target = _loaded(self.target, self.imports, self.allow)
        needs = mission_info(target.thing)
        if needs.real_time and brings_robots(target, self.words, self.inputs):
            hint = f" Try -i {needs.robots}=false." if isinstance(needs.robots, str) else ""
            raise MissionError(
                f"mission {target.name!r} needs real time: {needs.real_time}; expected one that "
                f"starts no robots.{hint}"
            )

    def __call__(self) -> Container:
        """Return a new machine."""
        from smachpy.command.mission_run import build

        return build(_loaded(self.target, self.imports, self.allow), self.inputs, self.words)


@cache
def _loaded(target: str, imports: bool, allow: tuple[str, ...] | None) -> Target:
    from smachpy.command.targets import load_target

    return load_target(target, imports=imports, allow=allow)


def reckoning_states(machine: Container) -> list[str]:
    """Return the paths of the states that only compute: they are explored as they are.

    With doubles in their places a mission that counts its rounds never ends.
    """
    from smachpy.states.by_name import Compute, SetKeys

    def below(container: Container, path: str) -> Iterator[str]:
        for label, state in container.get_children().items():
            if isinstance(state, Compute | SetKeys):
                yield f"{path}/{label}"
            elif isinstance(state, Container):
                yield from below(state, f"{path}/{label}")

    return list(below(machine, f"/{machine.name or 'SM_ROOT'}"))
