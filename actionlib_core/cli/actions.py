"""`actionlib list|info|type|find`: which actions there are."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._network import (
    action_class,
    find_ends,
    list_ends,
    open_node,
    show_type,
)
from actionlib_core.cli._output import add_json
from actionlib_core.presence import Kind

if TYPE_CHECKING:
    import argparse

    from actionlib_core.presence import Endpoint


def register(subparsers: Any) -> None:
    """Add the commands to an argparse subparsers object."""
    parser = subparsers.add_parser("list", help="list the actions there are")
    parser.add_argument("-t", "--show-types", action="store_true", help="also their types")
    parser.add_argument("-c", "--count-actions", action="store_true", help="only how many")
    add_json(parser)
    parser.set_defaults(run=_list)

    parser = subparsers.add_parser("info", help="show the clients and servers of an action")
    parser.add_argument("name", metavar="NAME")
    parser.add_argument("-t", "--show-types", action="store_true", help="also their types")
    parser.add_argument("-c", "--count", action="store_true", help="only how many")
    add_json(parser)
    parser.set_defaults(run=_info)

    parser = subparsers.add_parser("type", help="print the type of an action")
    parser.add_argument("name", metavar="NAME")
    add_json(parser)
    parser.set_defaults(run=_type)

    parser = subparsers.add_parser("find", help="list the actions of a type")
    parser.add_argument("type", metavar="TYPE", help="pkg/Name, pkg/action/Name or pkg/NameAction")
    parser.add_argument("-c", "--count-actions", action="store_true", help="only how many")
    add_json(parser)
    parser.set_defaults(run=_find)


def _types(ends: list[Endpoint]) -> list[str]:
    return sorted({show_type(end.type) for end in ends})


def _list(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        found = list_ends(node)
    if args.json:
        print(json.dumps([{"name": f"/{n}", "types": _types(e)} for n, e in found.items()]))
    elif args.count_actions:
        print(len(found))
    else:
        for name, ends in found.items():
            print(f"/{name} [{', '.join(_types(ends))}]" if args.show_types else f"/{name}")
    return 0


def _info(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name)
    groups = {
        title: [end for end in ends if end.kind is kind]
        for title, kind in (("clients", Kind.ACTION_CLIENT), ("servers", Kind.ACTION_SERVER))
    }
    if args.json:
        described = {
            title: [
                {"node": f"/{e.node}", "type": show_type(e.type), "session": e.session}
                for e in group
            ]
            for title, group in groups.items()
        }
        print(json.dumps({"name": f"/{ends[0].name}", **described}))
        return 0
    print(f"Action: /{ends[0].name}")
    for title, group in groups.items():
        print(f"Action {title}: {len(group)}")
        for end in () if args.count else group:
            print(f"    /{end.node}{f' [{show_type(end.type)}]' if args.show_types else ''}")
    return 0


def _type(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        types = _types(find_ends(node, args.name))
    print(json.dumps(types) if args.json else "\n".join(types))
    return 0


def _find(args: argparse.Namespace) -> int:
    wanted = show_type(action_class(args.type)._type)
    with open_node(args) as node:
        names = [f"/{name}" for name, ends in list_ends(node).items() if wanted in _types(ends)]
    if args.json:
        print(json.dumps(names))
    elif args.count_actions:
        print(len(names))
    else:
        for name in names:
            print(name)
    return 0
