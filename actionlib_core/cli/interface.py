"""`actionlib interface show|list|stubs`: the known messages, services and actions."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import UsageError
from actionlib_core.cli._command import add_command
from actionlib_core.cli._network import known, load_packages

if TYPE_CHECKING:
    import argparse

    from actionlib_core.interfaces._sources import Kind

_TITLES: dict[Kind, str] = {"msg": "Messages", "srv": "Services", "action": "Actions"}


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser(
        "interface",
        help="show message, service and action definitions",
        description="Definitions come with the package, from folders in SMACHPY_INTERFACE_PATH "
        "(my_pkg/msg/Name.msg, my_pkg/srv/Name.srv, my_pkg/action/Name.action), and from programs.",
    )
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    parser = add_command(verbs, "show", _show, "print a definition, nested types written out")
    parser.add_argument("name", metavar="NAME", help="pkg/Name or pkg/action/Name")
    parser.add_argument(
        "-a", "--all-comments", action="store_true", help="also the comments of nested types"
    )
    parser = add_command(verbs, "list", _list, "list all definitions found")
    parser.add_argument("-m", "--only-msgs", action="store_true", help="messages only")
    parser.add_argument("-s", "--only-srvs", action="store_true", help="services only")
    parser.add_argument("-a", "--only-actions", action="store_true", help="actions only")
    parser = add_command(verbs, "stubs", _stubs, "write typed .pyi files for editors and mypy")
    parser.add_argument("folder", metavar="DIR", help="where to; DIR/my_pkg/msg.pyi is written")
    parser.add_argument(
        "packages", metavar="PACKAGE", nargs="*", help="which (default: all not bundled)"
    )


def _show(args: argparse.Namespace) -> int:
    from actionlib_core.interfaces import _cli

    if "/" not in args.name:
        load_packages()
        names = sorted(name for found in _cli.list_interfaces().values() for name in found)
        near = [name for name in names if name.endswith(f"/{args.name}")]
        hint = f" Try {' or '.join(near)}." if near else ""
        raise UsageError(f"interface name: got {args.name!r}; expected 'package/Name'.{hint}")
    if args.json:
        print(json.dumps(known(_cli.describe, args.name), indent=2))
    else:
        print(known(partial(_cli.show, all_comments=args.all_comments), args.name))
    return 0


def _list(args: argparse.Namespace) -> int:
    from actionlib_core.interfaces import _cli

    asked: dict[Kind, bool] = {
        "msg": args.only_msgs,
        "srv": args.only_srvs,
        "action": args.only_actions,
    }
    kinds = [kind for kind, wanted in asked.items() if wanted or not any(asked.values())]
    load_packages()
    found = _cli.list_interfaces(kinds)
    if args.json:
        print(json.dumps(found, indent=2))
        return 0
    for kind in kinds:
        print(f"{_TITLES[kind]}:")
        for name in found[kind]:
            print(f"    {name}")
    return 0


def _stubs(args: argparse.Namespace) -> int:
    from actionlib_core.interfaces import _cli

    load_packages()
    try:
        written = [str(path) for path in _cli.write_stubs(args.folder, args.packages)]
    except OSError as error:
        problem = f"interface stubs: {args.folder!r}: cannot be written: {error.strerror}"
        raise UsageError(problem) from error
    print(json.dumps(written) if args.json else "\n".join(written))
    return 0
