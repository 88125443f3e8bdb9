"""`smachpy port`: rewrites a script for ROS 1 with smachpy's own API."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import printable
from smachpy.command.targets import TargetError

if TYPE_CHECKING:
    import argparse


def register(subparsers: Any) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "port",
        help="rewrite a ROS 1 script with the API of smachpy",
        description="Rewrite a script for ROS 1 with smachpy's own API, with its comments and "
        "layout, and list what a person must check.",
    )
    parser.add_argument("script", type=Path, metavar="SCRIPT", help="the script; it is not changed")
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        help="the new script; it must not exist yet (default: standard output)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Rewrite the script; notes go to standard error."""
    from smachpy.checks.unbuilt import changed_inputs
    from smachpy.ros1 import python2
    from smachpy.ros1.port import port

    try:
        source = args.script.read_bytes()
        ported = port(source, str(args.script))
    except OSError as error:
        raise TargetError(
            str(args.script), f"got nothing to read ({error.strerror or error}); expected a script."
        ) from error
    except SyntaxError as error:
        raise TargetError(
            str(args.script),
            f"line {error.lineno}: got a syntax error ({error.msg}); expected Python, 2 or 3.",
        ) from error
    if args.output is None:
        # As it is for files and pipes: it is a program.
        shown = printable(ported.text) if sys.stdout.isatty() else ported.text
        sys.stdout.write(shown)
    else:
        try:
            with Path(args.output).open("x", encoding="utf-8") as file:
                file.write(ported.text)
        except OSError as error:
            raise TargetError(
                args.output, f"got a failed write ({error.strerror or error}); expected a new file."
            ) from error
        print(printable(args.output))
    old = ast.parse(python2.to_text(python2.read(source), str(args.script)))
    for line, text in sorted({*ported.notes, *changed_inputs(old)}):
        print(printable(f"{args.script}:{line}: {text}"), file=sys.stderr)
    return 0
