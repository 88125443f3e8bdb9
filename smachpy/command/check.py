"""`smachpy check`: runs static checks from the command line."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core.process.output import printable
from smachpy.checks import check
from smachpy.checks.report import FORMATS
from smachpy.checks.suppression import read_settings
from smachpy.command.queued import add_allow_packages
from smachpy.command.ros1_options import add_options as add_ros1_options
from smachpy.command.ros1_options import load_any
from smachpy.command.run import add_input, built_to_look
from smachpy.command.targets import prints_aside
from smachpy.exceptions import did_you_mean

if TYPE_CHECKING:
    import argparse

    from smachpy.checks.report import Report
    from smachpy.checks.suppression import Settings


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser("check", help="find mistakes in a machine without running it")
    parser.add_argument(
        "targets",
        nargs="+",
        metavar="TARGET",
        help="mission, module:factory, path.py[:factory] or plan.pnml",
    )
    parser.add_argument("--format", choices=sorted(FORMATS), default="text", help="report format")
    parser.add_argument(
        "--property",
        action="append",
        default=[],
        dest="properties",
        help="a property of every run: never(STATE), always_reaches(OUTCOME, ...), "
        "before(STATE, STATE), after_preempt(STATE), after_any_end(STATE) (repeatable)",
    )
    parser.add_argument(
        "--enable",
        action="append",
        default=[],
        metavar="RULE",
        help="switch on a rule that is off by default: no-timeout (repeatable)",
    )
    add_input(parser)
    add_allow_packages(parser)
    parser.add_argument("--pictures", metavar="FOLDER", help="draw the runs that show problems")
    add_ros1_options(parser, loads=True)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Check the targets; return 1 if there are problems."""
    settings = read_settings(Path.cwd())
    with prints_aside(data=args.format != "text"):
        reports = [_check(text, args, settings) for text in args.targets]
    print(printable(FORMATS[args.format](reports)))
    _tell_unused(settings, [report.record.path[1:] for report in reports])
    if args.pictures:
        for report in reports:
            report.draw(args.pictures)
    return 0 if all(report.ok for report in reports) else 1


def _tell_unused(settings: Settings, checked: list[str]) -> None:
    """Report properties in pyproject.toml that no checked machine has: a wrong name, perhaps."""
    for name, _ in settings.properties:
        if name not in checked:
            print(
                printable(
                    f"smachpy: pyproject.toml: properties of {name!r} were not looked at; checked "
                    f"{', '.join(checked)}.{did_you_mean(name, checked)}"
                ),
                file=sys.stderr,
            )


def _check(text: str, args: argparse.Namespace, settings: Settings) -> Report:
    target = load_any(text, args)
    machine = built_to_look(target, args)
    name = machine.name or target.name
    own = [p for machine_name, texts in settings.properties if machine_name == name for p in texts]
    return check(
        machine,
        properties=[*args.properties, *own],
        ignores=settings.ignores,
        enable=[*args.enable, *settings.enable],
        name=name,
    )
