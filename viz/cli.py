"""`smachpy render`: a machine as a picture."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from smachpy.cli import UsageError

if TYPE_CHECKING:
    from smachpy.introspection import StateRecord

FORMATS = "svg, png, pdf, dot, json, mmd or txt"
EXAMPLES = """examples:
  smachpy render patrol -o patrol.svg
  smachpy render my_robot.missions:deliver -o deliver.png --theme dark --depth 2
  smachpy render mission.py -o - --active /MISSION/DRIVE > mission.svg
  smachpy render mission.py --atlas pages/
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
        help="a mission's name, module:factory, path.py[:factory], or a record written as .json",
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help=f"the ending names the format: {FORMATS}; - is svg"
    )
    parser.add_argument("--depth", type=_depth, metavar="N", help="container levels to open")
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
        "--show-implicit", action="store_true", help="draw transitions nobody wrote down as well"
    )
    parser.add_argument("--theme", choices=("light", "dark"), default="light")
    parser.add_argument(
        "--atlas", metavar="DIR", help="one linked SVG page per container, from index.svg"
    )
    parser.set_defaults(run=_run)


def _depth(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected a number from 1")
    return int(text)


def _run(args: argparse.Namespace) -> int:
    from viz import drawing, extract

    if not args.output and not args.atlas:
        raise UsageError(
            "smachpy render: got neither -o nor --atlas; expected where to draw. "
            f"Try -o {Path(args.target).stem or 'machine'}.svg"
        )
    record = _record(args.target)
    looks = {"theme": args.theme, "show_implicit": args.show_implicit}
    if args.atlas:
        part = extract.find(record, args.path) if args.path else record
        print(drawing.atlas(part, args.atlas, **looks))
    if args.output:
        looks |= {"depth": args.depth, "path": args.path, "active": args.active}
        if args.output == "-":
            import sys

            sys.stdout.buffer.write(drawing.picture(record, "svg", **looks))
        else:
            print(drawing.render(record, args.output, **looks))
    return 0


def _record(text: str) -> StateRecord:
    """The record of a machine that can be loaded, or one that was written down."""
    from smachpy.introspection import StateRecord, describe
    from smachpy.targets import load_target

    if not text.endswith(".json"):
        target = load_target(text)
        return describe(target.build())
    try:
        return StateRecord.from_json(Path(text).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"smachpy render: {text!r}: got {error}; expected a record that "
            "`smachpy render TARGET -o FILE.json` wrote."
        ) from error
