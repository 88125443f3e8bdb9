"""`smachpy render`: draws a machine as a picture."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.command_line.numbers import between
from actionlib_core.inputs import json_text
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.process.output import printable
from smachpy.command import UsageError
from smachpy.command.ros1_options import add_options as add_ros1_options
from smachpy.command.run import add_input, built_to_look
from smachpy.command.targets import prints_aside

if TYPE_CHECKING:
    from smachpy.events.introspection import StateRecord
    from smachpy_viz.runs.statistics import Statistics

FORMATS = "svg, png, pdf, dot, json, mmd or txt"
EXAMPLES = """examples:
  smachpy render patrol -o patrol.svg
  smachpy render my_robot.missions:deliver -o deliver.png --theme dark --depth 2
  smachpy render mission.py -o - --active /MISSION/DRIVE > mission.svg
  smachpy render mission.py --atlas pages/
  smachpy render patrol -o patrol.svg --runs runs/    with the statistics of recorded runs
"""


def register_render(
    subparsers: argparse._SubParsersAction[argparse.ArgumentParser],
) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "render",
        help="draw a state machine into a file",
        description="Draw a state machine, without running it.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "target",
        metavar="TARGET",
        help="a mission's name, module:factory, path.py[:factory], plan.pnml, or a record as .json",
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help=f"its extension chooses the format: {FORMATS}; - writes svg to standard output",
    )
    parser.add_argument("--depth", type=between(1), metavar="N", help="container levels to open")
    parser.add_argument("--path", metavar="/A/B", help="draw only this container")
    parser.add_argument(
        "--active",
        nargs="+",
        action="extend",
        default=[],
        metavar="PATH",
        help="mark these states as running",
    )
    parser.add_argument(
        "--show-implicit", action="store_true", help="also draw implicit transitions"
    )
    parser.add_argument("--theme", choices=("light", "dark"), default="light")
    parser.add_argument(
        "--atlas", metavar="DIR", help="write linked SVG pages, one per container, and index.svg"
    )
    parser.add_argument(
        "--runs",
        metavar="FILE|DIR",
        action="append",
        default=[],
        help="recorded runs (`smachpy run --record`): counts, shares, times and heat",
    )
    parser.add_argument(
        "--heat",
        choices=("time", "failures"),
        default="time",
        help="the statistic of --runs by which states are coloured (default: %(default)s)",
    )
    add_input(parser)
    add_ros1_options(parser, loads=True)
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    from smachpy_viz.model import extract
    from smachpy_viz.pictures import drawing

    if not args.output and not args.atlas:
        raise UsageError(
            "smachpy render: got neither -o nor --atlas; expected one of them. "
            f"Try -o {Path(args.target).stem or 'machine'}.svg"
        )
    # Atlas and picture can be asked for together; they share the record and the statistics.
    with prints_aside(data=args.output == "-"):
        record = read_record(args.target, args)
    looks: dict[str, Any] = {"theme": args.theme, "show_implicit": args.show_implicit}
    if args.runs:
        from smachpy_viz.runs.statistics import marks_of

        statistics = _statistics(args, record)
        looks["run"] = marks_of(statistics, record, heat=args.heat)
        looks["legend"] = _legend(statistics, args.heat)
    if args.atlas:
        part = extract.find(record, args.path) if args.path else record
        print(printable(drawing.atlas(part, args.atlas, **looks)))
    if args.output:
        looks |= {"depth": args.depth, "path": args.path, "active": args.active}
        if args.output == "-":
            import sys

            sys.stdout.buffer.write(drawing.picture(record, "svg", **looks))
        else:
            print(printable(drawing.render(record, args.output, **looks)))
    return 0


def _statistics(args: argparse.Namespace, record: StateRecord) -> Statistics:
    from smachpy_viz.runs.statistics import StatisticsOfFiles

    counted = StatisticsOfFiles(args.runs).counted()
    if record.label not in counted:
        found = ", ".join(map(repr, counted)) or "no machine"
        raise UsageError(
            f"smachpy render: --runs: got runs of {found}; expected some of {record.label!r}. "
            f"Try: smachpy run {args.target} --record {args.runs[0]}/1.jsonl"
        )
    return counted[record.label]


def _legend(statistics: Statistics, heat: str) -> tuple[tuple[str, str], ...]:
    """The legend for the statistics in the picture."""
    ends = ", ".join(f"{outcome} \u00d7{n}" for outcome, n in statistics.outcomes.items())
    words = {"time": "the longer in all", "failures": "the more failed"}[heat]
    return (
        ("", f"{statistics.runs} runs: {ends or 'none has ended'}"),
        ("heat", f"the warmer, {words}"),
        ("", "\u00d7: visits, then their median time"),
    )


def read_record(text: str, args: argparse.Namespace | None = None) -> StateRecord:
    """Return the record of a machine, or read one from a .json file.

    Args:
        text: The machine or file, as given by the user.
        args: The command line, if it has the options for ROS 1 scripts.

    Raises:
        UsageError: the file does not exist, or is not a record.
        SmachError: the machine cannot be loaded.
    """
    from smachpy.command.ros1_options import load_any
    from smachpy.command.targets import load_target
    from smachpy.events.introspection import StateRecord, describe

    if not text.endswith(".json"):
        target = load_target(text, imports=False) if args is None else load_any(text, args)
        return describe(target.build() if args is None else built_to_look(target, args))
    try:
        return StateRecord.from_json(read_limited(text, json_text.MAX_JSON_LENGTH).decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        said = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise UsageError(
            f"{text!r}: {said.rstrip('.')}. "
            "Try a record that `smachpy render TARGET -o FILE.json` wrote."
        ) from error
