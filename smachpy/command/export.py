"""`smachpy export`: writes a machine as a Petri net, for other tools."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.command import UsageError
from smachpy.command.targets import load_target

if TYPE_CHECKING:
    import argparse


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "export",
        help="write a machine as a Petri net",
        description="Write a machine, or a plan, as a Petri net in PNML.",
    )
    parser.add_argument(
        "target", metavar="TARGET", help="mission, module:factory, path.py[:factory] or plan.pnml"
    )
    parser.add_argument("--pnml", metavar="FILE", required=True, help="where to write it")
    parser.add_argument(
        "--dialect",
        choices=("pnp", "2009"),
        default="pnp",
        help="pnp: for the tools of PNP; 2009: PNML 2009, for others (default: %(default)s)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the file."""
    from smachpy.pnp.export import export_net
    from smachpy.pnp.pnml import write_pnml

    exported = export_net(load_target(args.target).build())
    try:
        print(write_pnml(exported.net, args.pnml, dialect=args.dialect))
    except OSError as error:
        raise UsageError(
            f"smachpy export: {args.pnml!r} cannot be written: {error.strerror}"
        ) from error
    return 0
