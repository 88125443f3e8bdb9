"""`smachpy simulate`: does many runs of a mission in virtual time."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.command_line.numbers import between
from actionlib_core.process.output import printable
from actionlib_core.process.private_files import make_private_folder
from smachpy.command import UsageError
from smachpy.command.durable import whole_target
from smachpy.command.on import ProgressLine, add_jobs_and_on, opened_cluster, workers_text
from smachpy.command.queued import add_allow_packages
from smachpy.command.run import time_span
from smachpy.command.targets import prints_aside

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor

    from smachpy_viz.runs.report import MachineRuns
    from smachpy_viz.runs.simulate import Result, Vary

EXAMPLES = """examples:
  smachpy simulate patrol --runs 100 --vary battery=0.2..1.0
  smachpy simulate patrol --vary battery=0.2..1.0 --vary robot.max_speed=0.4..1.2 -o report.html
  smachpy simulate there_and_back --vary x=2,4,8 --record runs/ --compare last_week/
  smachpy simulate patrol --runs 10000 --executor my_cluster:executor
"""
MAX_RUNS = 100_000
MAX_FAILURES = 5
"""Failed runs that are described in the output."""


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "simulate",
        help="do many runs of a mission in virtual time",
        description="Do many runs of a mission with the simulated robot, in virtual time and in "
        "parallel, with varying values. Exit codes: 0 all runs ended, 1 some raised an exception "
        "or did not end, 2 bad input.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("mission", metavar="MISSION", help="as for `smachpy run`")
    parser.add_argument(
        "--runs",
        type=between(1, MAX_RUNS),
        default=20,
        metavar="N",
        help="number of runs (default: %(default)s)",
    )
    parser.add_argument(
        "--vary",
        type=_vary,
        action="append",
        default=[],
        metavar="KEY=LOW..HIGH",
        help="an argument of the mission, a userdata key or a parameter of the robot; or "
        "KEY=ONE,OTHER; may be repeated",
    )
    parser.add_argument(
        "--seed",
        type=int,
        default=1,
        help="the same seed makes the same runs (default: %(default)s)",
    )
    add_jobs_and_on(parser)
    parser.add_argument(
        "--limit",
        type=time_span,
        default="4h",
        metavar="TIME",
        help="virtual time after which a run is preempted and reported, such as 30s, 10m or 2h "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--executor",
        metavar="MODULE:FUNCTION",
        help="a function that returns the concurrent.futures.Executor for the runs, such as that "
        "of a cluster (default: processes on this computer)",
    )
    add_allow_packages(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object per run, for programs")
    parser.add_argument(
        "--record", type=Path, metavar="DIR", help="keep the recordings in this new folder"
    )
    parser.add_argument(
        "--compare", metavar="DIR", help="recordings of earlier runs, to list what differs"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="a report (.html), or a picture of the machine with the statistics (svg, png, pdf)",
    )
    parser.set_defaults(run=_run)


def _vary(text: str) -> Vary:
    from smachpy_viz.runs.simulate import Vary

    try:
        return Vary.read(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _run(args: argparse.Namespace) -> int:
    keys = [vary.key for vary in args.vary]
    if len(set(keys)) < len(keys):
        raise UsageError(f"smachpy simulate: --vary: got {keys}; expected each key once.")
    if args.record is None:
        with tempfile.TemporaryDirectory(prefix="smachpy-simulate-") as folder:
            return _simulate(args, Path(folder))
    try:
        make_private_folder(args.record)
        if any(args.record.iterdir()):
            raise UsageError(
                f"smachpy simulate: --record {str(args.record)!r}: got a folder that is not empty; "
                "expected a new one: runs are never overwritten."
            )
    except OSError as error:
        raise UsageError(
            f"smachpy simulate: --record {str(args.record)!r}: {error.strerror or error}."
        ) from error
    return _simulate(args, args.record)


def _simulate(args: argparse.Namespace, folder: Path) -> int:
    from smachpy_viz.runs.cli import (
        check_extension,
        collect_one,
        console,
        print_differences,
        print_statistics,
    )
    from smachpy_viz.runs.simulate import SimulationPlan, simulate

    # First: a mistake in a name should not be reported after an hour of simulation.
    if args.output is not None:
        check_extension("simulate", args.output, "html")
        if not args.output.parent.is_dir():
            raise UsageError(
                f"smachpy simulate: {str(args.output)!r}: got no folder "
                f"{str(args.output.parent)!r}; expected one that exists."
            )
    before = None if args.compare is None else collect_one(args.compare, "simulate --compare")
    if args.on is not None and args.executor is not None:
        raise UsageError("smachpy simulate: got --on and --executor; expected one of them.")
    mission = args.mission if args.on is None else whole_target(args.mission)
    plan = SimulationPlan(mission, args.runs, folder, args.vary, args.seed, args.limit, args.allow)
    with prints_aside(data=args.json):
        plan.tasks()  # a mistake is to be told before the workers are asked
    with (
        opened_cluster(args.on, mission, args.allow) as cluster,
        _executor(args.executor) as executor,
    ):
        who = "" if args.executor else workers_text(cluster, args.jobs, args.runs)
        progress = _RunCounter(args.runs, who, as_json=args.json)
        try:
            with prints_aside(data=args.json):
                results = simulate(plan, cluster or executor, progress.on_result, jobs=args.jobs)
        finally:
            progress.end()
    failed = [result for result in results if result.outcome is None]
    if not any(result.task.file.exists() for result in results):  # then there is nothing to count
        raise UsageError(f"smachpy simulate: no run has ended; run 1: {failed[0].error}")
    runs = collect_one(str(folder), "simulate")
    values = {str(result.task.file): result.task.values for result in results}
    if not args.json:
        print_statistics(console(), runs.record, runs.statistics, 0)
        _print_varied(runs, values)
        for result in failed[:MAX_FAILURES]:
            print(printable(f"run {result.task.number}: {_error_text(result)}"))
        if len(failed) > MAX_FAILURES:
            print(f"and {len(failed) - MAX_FAILURES:d} more")
        if before is not None:
            print_differences(before, runs)
    if args.output is not None:
        written = _write(args.output, runs, before, values)
        print(printable(written), file=sys.stderr if args.json else sys.stdout)
    return 1 if failed else 0


def _error_text(result: Result) -> str:
    chosen = ", ".join(f"{key}={value}" for key, value in result.task.values.items())
    return f"{result.error} ({chosen})" if chosen else result.error


def _print_varied(runs: MachineRuns, values: Any) -> None:
    """Print the outcomes by each varied value."""
    from smachpy_viz.runs.report import by_quarter

    for key in dict.fromkeys(key for one in values.values() for key in one):
        print(printable(f"{key}:"))
        for words, ends in by_quarter(runs, values, key):
            outcomes = ", ".join(f"{outcome} x{n}" for outcome, n in ends.most_common())
            print(printable(f"  {words:20} {outcomes}"))


def _write(output: Path, runs: MachineRuns, before: MachineRuns | None, values: Any) -> Path:
    from smachpy_viz.pictures.drawing import render, write
    from smachpy_viz.runs.report import report
    from smachpy_viz.runs.statistics import marks_of

    if output.suffix.lower() != ".html":
        return render(runs.record, output, run=marks_of(runs.statistics, runs.record))
    page = report(runs, before=before, values=values if any(values.values()) else None)
    return write(page.encode("utf-8", "replace"), output)


@contextlib.contextmanager
def _executor(name: str | None) -> Iterator[Executor | None]:
    """Call the user's function for an executor; None without one: the default pool."""
    if name is None:
        yield None
        return
    module, colon, function = name.partition(":")
    sys.path.insert(0, "")  # the current folder, as for missions
    try:
        made = getattr(importlib.import_module(module), function)() if colon else None
    except Exception as error:
        raise UsageError(
            f"smachpy simulate: --executor {name!r}: {type(error).__name__}: {error}"
        ) from error
    finally:
        sys.path.remove("")
    if not callable(getattr(made, "submit", None)):
        raise UsageError(
            f"smachpy simulate: --executor {name!r}: got {type(made).__name__}; expected "
            "MODULE:FUNCTION that returns a concurrent.futures.Executor."
        )
    assert made is not None
    with made as executor:
        yield executor


class _RunCounter:
    """Shows in a terminal how many runs have ended, or prints one line of JSON per run.

    The lines are in the order of the runs, however many are done at the same time.
    """

    def __init__(self, runs: int, who: str, *, as_json: bool) -> None:
        self._done = 0
        self._json = as_json
        self._out = sys.stdout  # also while what missions print goes elsewhere
        self._waiting: dict[int, Result] = {}
        self._printed = 0
        shown = sys.stderr.isatty() and not as_json
        self._progress = ProgressLine(f"of {runs} runs", who, shown=shown)
        self.end = self._progress.end

    def on_result(self, result: Result) -> None:
        """Count an ended run."""
        self._done += 1
        self._waiting[result.task.number] = result
        while self._json and self._printed + 1 in self._waiting:
            self._printed += 1
            result = self._waiting.pop(self._printed)
            task = result.task
            facts: dict[str, Any] = {
                "run": task.number,
                "outcome": result.outcome,
                "error": result.error,
                "values": dict(task.values),
                "seed": task.seed,
            }
            print(json.dumps(facts), file=self._out, flush=True)
        self._progress.show(self._done)
