"""The commands `list` and `type` of actions, topics and services."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_ERROR
from actionlib_core.cli._command import add_command
from actionlib_core.cli._network import find_ends, list_names, open_node, types_of
from actionlib_core.process.output import tell
from actionlib_core.wire.presence import SETTLE_MOST_S

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Collection

    from actionlib_core.transport.tokens import Endpoint, Kind


def add_list(
    verbs: Any,
    what: str,
    kinds: Collection[Kind],
    record: Callable[[str, list[Endpoint]], dict[str, Any]],
) -> argparse.ArgumentParser:
    """Add the command `list`.

    Args:
        verbs: An argparse subparsers object.
        what: The kind of names, in the plural.
        kinds: The kinds of ends to list.
        record: Returns the object that `--json` prints for a name and its ends.
    """
    run = partial(_list, kinds, record)
    parser = add_command(verbs, "list", run, f"list the {what} on the network")
    parser.add_argument("-t", "--show-types", action="store_true", help="with their types")
    parser.add_argument(
        "-c", f"--count-{what}", dest="count", action="store_true", help="only how many"
    )
    return parser


def _list(
    kinds: Collection[Kind],
    record: Callable[[str, list[Endpoint]], dict[str, Any]],
    args: argparse.Namespace,
) -> int:
    with open_node(args) as node:
        found = list_names(node, kinds)
    if args.json:
        print(json.dumps([record(name, ends) for name, ends in found.items()]))
    elif args.count:
        print(len(found))
    else:
        for name, ends in found.items():
            print(f"/{name} [{', '.join(types_of(ends))}]" if args.show_types else f"/{name}")
    if getattr(args, "settled", True):
        return 0
    tell(
        "actionlib",
        f"more names were still found after {SETTLE_MOST_S:g} s: the list may be incomplete. Try "
        "again, or a router (`actionlib router`) for a network with so many names.",
    )
    return EXIT_ERROR


def add_type(verbs: Any, what: str, kinds: Collection[Kind]) -> None:
    """Add the command `type`."""
    parser = add_command(verbs, "type", partial(_type, kinds), f"print the type of {what}")
    parser.add_argument("name", metavar="NAME")


def _type(kinds: Collection[Kind], args: argparse.Namespace) -> int:
    with open_node(args) as node:
        types = types_of(find_ends(node, args.name, kinds))
    print(json.dumps(types) if args.json else "\n".join(types))
    return 0
