"""`smachpy states`: the states that mission files can name, with their arguments."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING

from actionlib_core.process.output import printable
from smachpy.base.problems import unknown_name
from smachpy.command import UsageError
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable
    from typing import Any


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "states",
        help="list the states that mission files can name",
        description="The registered states: those of smachpy, and the entry points "
        "'smachpy.states' of installed packages.",
    )
    commands = parser.add_subparsers(dest="what", required=True, metavar="COMMAND")
    commands.add_parser("list", help="their names, each with its first line").set_defaults(
        run=_list
    )
    show = commands.add_parser("show", help="the arguments and outcomes of one")
    show.add_argument("name", metavar="NAME")
    show.set_defaults(run=_show)


def _list(_args: argparse.Namespace) -> int:
    from smachpy.files.reference import registered

    known = registered()
    width = max(map(len, known))
    for name in sorted(known):
        try:
            text = _doc(known[name]()).partition("\n")[0]
        except Exception as error:  # noqa: BLE001  another package's: the others are listed
            text = f"not available: {error_text(error)}"
        print(printable(f"{name:{width}}  {text}"))
    return 0


def _show(args: argparse.Namespace) -> int:
    from smachpy.files.reference import registered

    known = registered()
    if args.name not in known:
        raise UsageError(f"smachpy states: {unknown_name('state', args.name, sorted(known))}")
    make: Callable[..., Any] = known[args.name]()
    print(printable(f"{args.name}{_signature(make)}\n\n{_doc(make)}"))
    return 0


def _signature(make: Callable[..., Any]) -> str:
    shown = inspect.signature(make).replace(return_annotation=inspect.Signature.empty)
    return str(shown).replace("'", "")


def _doc(make: Callable[..., Any]) -> str:
    return inspect.getdoc(make) or "no description"
