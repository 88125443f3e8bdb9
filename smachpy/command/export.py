"""`smachpy export`: writes a machine as a mission file, or as a Petri net for other tools."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from actionlib_core.process.output import printable
from smachpy.command import UsageError
from smachpy.command.run import add_input, built_to_look
from smachpy.command.targets import load_target

if TYPE_CHECKING:
    import argparse


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "export",
        help="write a machine as a mission file or a Petri net",
        description="Write a machine as a mission file, or a machine or plan as a Petri net in "
        "PNML.",
    )
    parser.add_argument(
        "target", metavar="TARGET", help="mission, module:factory, path.py[:factory] or plan.pnml"
    )
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("-o", "--output", metavar="FILE.yaml", help="write a mission file")
    where.add_argument("--pnml", metavar="FILE", help="write a Petri net")
    parser.add_argument(
        "--dialect",
        choices=("pnp", "2009"),
        default="pnp",
        help="pnp: for the tools of PNP; 2009: PNML 2009, for others (default: %(default)s)",
    )
    add_input(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the file."""
    if args.output is not None:
        return _write_file(args)
    from smachpy.pnp.export import export_net
    from smachpy.pnp.pnml import write_pnml

    exported = export_net(built_to_look(load_target(args.target, imports=False), args))
    try:
        print(printable(write_pnml(exported.net, args.pnml, dialect=args.dialect)))
    except OSError as error:
        raise UsageError(
            f"smachpy export: {args.pnml!r} cannot be written: {error.strerror}"
        ) from error
    return 0


def _write_file(args: argparse.Namespace) -> int:
    """Write a mission file."""
    from smachpy.files import NotWrittenError, write
    from smachpy.files.others import not_kept
    from smachpy.machines.state_machine import StateMachine

    target, output = args.target, args.output
    machine = built_to_look(load_target(target, imports=False), args)
    for line in not_kept(machine):
        print(printable(line), file=sys.stderr)
    if type(machine) is not StateMachine:
        got = type(machine).__name__
        raise UsageError(f"smachpy export: got a {got}; expected a state machine for a file.")
    try:
        write(machine, output)
    except NotWrittenError as error:
        lines = "\n".join(f"  {problem}" for problem in error.problems)
        raise UsageError(f"smachpy export: {target!r} cannot be written:\n{lines}") from error
    except OSError as error:
        problem = f"smachpy export: {output!r} cannot be written: {error.strerror}"
        raise UsageError(problem) from error
    print(printable(output))
    return 0
