"""`actionlib list|info|type|find`: the actions on the network."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._command import add_command
from actionlib_core.cli._listing import add_list, add_type
from actionlib_core.cli._network import (
    ACTION_KINDS,
    find_ends,
    list_names,
    open_node,
    show_type,
    typed_class,
    types_of,
)
from actionlib_core.transport.tokens import Kind

if TYPE_CHECKING:
    import argparse


def register(subparsers: Any) -> None:
    """Add the commands to an argparse subparsers object."""
    add_list(
        subparsers, "actions", ACTION_KINDS, lambda n, e: {"name": f"/{n}", "types": types_of(e)}
    )
    add_type(subparsers, "an action", ACTION_KINDS)
    parser = add_command(subparsers, "info", _info, "show the clients and servers of an action")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("-t", "--show-types", action="store_true", help="also their types")
    parser.add_argument("-c", "--count", action="store_true", help="only how many")
    parser = add_command(subparsers, "find", _find, "list the actions of a type")
    parser.add_argument("type", metavar="TYPE", help="pkg/Name, pkg/action/Name or pkg/NameAction")
    parser.add_argument("-c", "--count-actions", action="store_true", help="only how many")


def _info(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name, ACTION_KINDS)
    groups = {
        title: [(f"/{end.node}", *types_of([end]), end.session) for end in ends if end.kind is kind]
        for title, kind in (("clients", Kind.ACTION_CLIENT), ("servers", Kind.ACTION_SERVER))
    }
    if args.json:
        described = {
            title: [dict(zip(("node", "type", "session"), end, strict=True)) for end in group]
            for title, group in groups.items()
        }
        print(json.dumps({"name": f"/{ends[0].name}", **described}))
        return 0
    print(f"Action: /{ends[0].name}")
    for title, group in groups.items():
        print(f"Action {title}: {len(group)}")
        for node_name, type_name, _ in () if args.count else group:
            print(f"    {node_name}{f' [{type_name}]' if args.show_types else ''}")
    return 0


def _find(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        wanted = show_type(Kind.ACTION_SERVER, typed_class(node, "action", args.type)._type)
        actions = list_names(node, ACTION_KINDS)
    names = [f"/{name}" for name, ends in actions.items() if wanted in types_of(ends)]
    if args.json:
        print(json.dumps(names))
    elif args.count_actions:
        print(len(names))
    else:
        for name in names:
            print(name)
    return 0
