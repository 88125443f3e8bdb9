"""`smachpy certify`: checks, explores, simulates and reproduces a mission, and writes evidence."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import Counter
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from actionlib_core.command_line.numbers import between, seconds
from actionlib_core.process.output import printable
from smachpy.command import UsageError
from smachpy.command.durable import whole_target
from smachpy.command.on import add_jobs_and_on, opened_cluster
from smachpy.command.queued import add_allow_packages
from smachpy.command.run import add_input, read_inputs
from smachpy.userdata.secret import MASK, hides, holds_secret

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from smachpy.base.cluster import Cluster
    from smachpy.command.arguments import Text
    from smachpy.command.explore import MissionMaker

FAULTS: Final = ("deaf", "hang", "kill", "raise")
EXAMPLES = """examples:
  smachpy certify patrol --property 'before(/PATROL/UNDOCK, /PATROL/ROUND)' -o evidence.json
  smachpy certify my_mission.py --faults all --recordings last_month/ -o evidence.json
  smachpy runner --db queue.db --allow . --require-evidence evidence.json
"""
ASSUMED: Final = (
    "in the exploration doubles stand for the states: they do nothing but end with an outcome",
    "a double takes a second, or as long as it needs to outlast others",
    "the arguments of the mission are these inputs, and else its defaults",
    "the simulated robot behaves as the real one",
    "what the mission imports by a name that is computed is not in its hash",
)
"""What holds for every evidence, in words."""


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "certify",
        help="try a mission in all ways, and write what was found",
        description="Check, explore and simulate a mission, run its recordings again, and write "
        "one file with the hash of mission and library, what was tried, what was assumed, and what "
        "was found. Exit codes: 0 all is good, 1 something was found (the file says what), 2 bad "
        "input.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("mission", metavar="MISSION", help="as for `smachpy run`")
    add_input(parser)
    parser.add_argument(
        "--property",
        action="append",
        default=[],
        dest="properties",
        help="a property of every run, as for `smachpy check` (repeatable)",
    )
    parser.add_argument(
        "--faults",
        type=_faults,
        default=(),
        metavar="all|NAME,...",
        help=f"faults to explore: some of {', '.join(FAULTS)} (default: none)",
    )
    parser.add_argument(
        "--max-runs",
        type=between(1),
        default=1_000,
        metavar="N",
        help="the most runs of the exploration (default: %(default)s)",
    )
    parser.add_argument(
        "--max-time",
        type=seconds,
        default=60.0,
        metavar="S",
        help="the longest exploration [s] (default: %(default)g)",
    )
    parser.add_argument(
        "--runs",
        type=between(0, 100_000),
        default=20,
        metavar="N",
        help="number of simulated runs (default: %(default)s)",
    )
    parser.add_argument(
        "--recordings", metavar="DIR", help="run these recordings again; all must be the same"
    )
    add_jobs_and_on(parser)
    add_allow_packages(parser)
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE", help="a new file, .json"
    )
    parser.set_defaults(run=_run)


def _faults(text: str) -> tuple[str, ...]:
    names = FAULTS if text == "all" else tuple(sorted(set(filter(None, text.split(",")))))
    if not {*names} <= {*FAULTS}:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected all, or some of {list(FAULTS)}")
    return names


def _run(args: argparse.Namespace) -> int:
    from smachpy.command.evidence import FORMAT, VERSION, library_facts, mission_facts
    from smachpy.command.targets import load_target

    where = f"smachpy certify: -o {str(args.output)!r}"
    if args.output.suffix != ".json":
        raise UsageError(f"{where}: expected a name that ends with .json.")
    if args.output.exists() or not args.output.parent.is_dir():
        raise UsageError(f"{where}: expected a new file, in a folder that exists.")
    recordings = _recordings(args.recordings)
    target, inputs = load_target(args.mission, allow=args.allow), read_inputs(args.input)
    # First: the mission of these files is tried.
    mission, library = mission_facts(target, args.mission), library_facts()
    evidence: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "made": datetime.fromtimestamp(RealClock().time_ns() / 1e9, UTC).isoformat(),
        "ok": False,
        "mission": mission,
        "inputs": {
            key: MASK if hides(key, value) or holds_secret(value) else str(value)
            for key, value in inputs.items()
        },
        "library": library,
        "assumed": list(ASSUMED),
    }
    taken: dict[str, set[str]] = {"explored": set(), "simulated": set(), "recorded": set()}
    with opened_cluster(args.on, _named(args), args.allow) as cluster:
        parts: dict[str, Callable[[], dict[str, Any]]] = {
            "check": lambda: _checked(args, inputs),
            "explore": lambda: _explored(args, inputs, taken["explored"], cluster),
            "simulate": lambda: _simulated(args, inputs, taken["simulated"], cluster),
            "reproduce": lambda: _reproduced(args, recordings, taken["recorded"], cluster),
        }
        for name, try_it in parts.items():
            part = evidence[name] = try_it()
            print(printable(f"{target.name}: {name}: {part['said']}"), flush=True)
    evidence["taken"] = {kind: sorted(found) for kind, found in taken.items()}
    evidence["ok"] = all(evidence[name]["ok"] for name in parts)
    if mission_facts(target, args.mission) != mission:
        raise UsageError(f"{where}: the mission's files have changed meanwhile; expected the same.")
    try:
        with args.output.open("x", encoding="utf-8") as file:
            file.write(json.dumps(evidence, indent=1) + "\n")
    except OSError as error:
        raise UsageError(f"{where}: cannot write: {error.strerror or error}.") from error
    verdict = "all is good" if evidence["ok"] else "something was found"
    print(printable(f"{args.output}: {target.name} {mission['hash']}: {verdict}"))
    return 0 if evidence["ok"] else 1


def _named(args: argparse.Namespace) -> str:
    """Return the mission as those know it who do the runs."""
    return args.mission if args.on is None else whole_target(args.mission)


def _checked(args: argparse.Namespace, inputs: Mapping[str, Text]) -> dict[str, Any]:
    from smachpy.checks import check
    from smachpy.checks.suppression import read_settings

    machine = _maker(args, inputs)()
    settings = read_settings(Path.cwd())
    own = [one for name, texts in settings.properties if name == machine.name for one in texts]
    report = check(
        machine,
        properties=[*args.properties, *own],
        ignores=settings.ignores,
        enable=settings.enable,
        name=machine.name or None,
    )
    problems = [f"{one.severity}: {one.message} [{one.rule}]" for one in report.problems]
    ignored = [f"{one.severity}: {one.message} [{one.rule}]: {why}" for one, why in report.ignored]
    count = len(args.properties) + len(own)
    said = [*problems, f"{count} properties" if count else "no properties"]
    return {
        "ok": report.ok,
        "said": "; ".join(said if problems else ["no problem", *said]),
        "properties": [*args.properties, *own],
        "problems": problems,
        "ignored": ignored,
    }


def _maker(args: argparse.Namespace, inputs: Mapping[str, Text]) -> MissionMaker:
    from smachpy.command.explore import MissionMaker

    return MissionMaker(_named(args), inputs, imports=True, allow=tuple(args.allow))


def _explored(
    args: argparse.Namespace,
    inputs: Mapping[str, Text],
    taken: set[str],
    cluster: Cluster | None,
) -> dict[str, Any]:
    from smachpy.command.explore import reckoning_states
    from smachpy.events.introspection import describe
    from smachpy.testing.coverage import KINDS, Coverage
    from smachpy.testing.exploring.exploration import explore

    make = _maker(args, inputs)
    make.check()
    machine = make()
    keep, coverage = reckoning_states(machine), Coverage()
    found = explore(
        make,
        max_runs=args.max_runs,
        max_time=args.max_time,
        faults=args.faults,
        keep=keep,
        on_run=coverage.add,
        jobs=args.jobs,
        cluster=cluster,
    )
    taken.update(coverage.machines[0].taken["edges"])
    leaves = [one.path for one in describe(machine).walk() if not one.is_container]
    counts = {kind: list(coverage.machines[0].counts(kind)) for kind in KINDS}
    missed = {kind: coverage.machines[0].missed(kind) for kind in KINDS}
    return {
        "ok": found.ok,
        "said": str(found).partition("\n")[0],
        "faults": list(args.faults),
        "runs": found.runs,
        "exhaustive": found.exhaustive,
        "stopped_by": found.stopped_by,
        "not_raised": list(found.not_raised),
        "doubles": [path for path in leaves if path not in keep],
        "coverage": counts,
        "missed": missed,
        "counterexample": None if found.counterexample is None else str(found.counterexample),
    }


def _simulated(
    args: argparse.Namespace,
    inputs: Mapping[str, Text],
    taken: set[str],
    cluster: Cluster | None,
) -> dict[str, Any]:
    from smachpy.command.evidence import transitions_of
    from smachpy.events.recording import read_recording
    from smachpy_viz.runs.simulate import SimulationPlan, Vary, simulate

    if not args.runs:
        return {"ok": True, "said": "no runs", "runs": 0, "outcomes": {}, "failed": []}
    given = [Vary(key, choices=(str(value),)) for key, value in inputs.items()]
    with tempfile.TemporaryDirectory(prefix="smachpy-certify-") as folder:
        plan = SimulationPlan(_named(args), args.runs, Path(folder), given, allow=args.allow)
        results = simulate(plan, cluster, jobs=args.jobs)
        for one in results:
            if one.outcome is not None:
                taken |= transitions_of(read_recording(one.task.file, plots=False).events)
    ends = Counter(one.outcome for one in results if one.outcome is not None)
    failed = [f"run {one.task.number}: {one.error}" for one in results if one.outcome is None]
    said = [f"{outcome} x{count}" for outcome, count in ends.most_common()]
    return {
        "ok": not failed,
        "said": f"{args.runs} runs; {', '.join([*said, *failed[:3]])}",
        "runs": args.runs,
        "seed": plan.seed,
        "outcomes": dict(ends),
        "failed": failed,
    }


def _recordings(place: str | None) -> list[str]:
    """Return the files to reproduce.

    Raises:
        RecordingError, UsageError: there are none, although a place is given.
    """
    from smachpy.events.recording import find_recordings

    if place is None:
        return []
    paths = [str(path) for path in find_recordings([place])]
    if not paths:
        raise UsageError(
            f"smachpy certify: --recordings {place!r}: got none; expected *.jsonl files."
        )
    return paths


def _reproduced(
    args: argparse.Namespace, paths: list[str], taken: set[str], cluster: Cluster | None
) -> dict[str, Any]:
    from smachpy.command.evidence import transitions_of
    from smachpy.events.recording import read_recording
    from smachpy.reproduce.report import summary
    from smachpy.reproduce.task import Options
    from smachpy_viz.runs.reproduce_cli import verdicts_of

    if not paths:
        return {"ok": True, "said": "no recordings", "recordings": []}
    options = Options(_named(args), tuple(args.allow))
    verdicts = list(verdicts_of(paths, options, args.jobs, cluster))
    for one in verdicts:
        if one.kind != "failed":
            taken |= transitions_of(read_recording(one.path, plots=False).events)
    return {
        "ok": all(one.kind == "same" for one in verdicts),
        "said": summary(verdicts),
        "recordings": [one.to_json() for one in verdicts],
    }
