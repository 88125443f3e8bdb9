"""`actionlib service list|call|type`, with the flags of `ros2 service`."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED, UsageError
from actionlib_core.cli._ends import ends_by_name, find_ends, only_type, types_of
from actionlib_core.cli._network import SETTLE_S, open_node
from actionlib_core.cli._numbers import rate, seconds
from actionlib_core.cli._packages import known
from actionlib_core.exceptions import ServiceException
from actionlib_core.presence import Kind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from actionlib_core.interfaces import ServiceType
    from actionlib_core.node import Node

KINDS = (Kind.SERVICE,)


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser("service", help="list and call services")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    listing = _add(verbs, "list", _list, "list the services there are")
    listing.add_argument("-t", "--show-types", action="store_true", help="with their types")
    listing.add_argument("-c", "--count-services", action="store_true", help="only how many")
    listing.add_argument("--json", action="store_true", help="as JSON")
    typing = _add(verbs, "type", _type, "print the type of a service")
    typing.add_argument("name", metavar="NAME")
    typing.add_argument("--json", action="store_true", help="as JSON")
    call = _add(verbs, "call", _call, "call a service and print the response")
    call.add_argument("name", metavar="NAME")
    call.add_argument(
        "words", metavar="[TYPE] [YAML]", nargs="*",
        help="the type (default: what the server says) and the request, '{data: true}'",
    )  # fmt: skip
    call.add_argument("--stdin", action="store_true", help="read the request from standard input")
    call.add_argument("-r", "--rate", type=rate, metavar="HZ", help="call again and again")
    call.add_argument(
        "--timeout", type=seconds, default=10.0, metavar="S", help="longest wait [s] (default: 10)"
    )
    call.add_argument("--json", action="store_true", help="the response as JSON")


def _add(verbs: Any, name: str, run: Callable[[argparse.Namespace], int], help_: str) -> Any:
    parser = verbs.add_parser(name, help=help_)
    parser.set_defaults(run=run)
    return parser


def _list(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = ends_by_name(node, KINDS)
    services = {name: ", ".join(types_of(there, "srv")) for name, there in ends.items()}
    if args.json:
        print(json.dumps([{"name": f"/{n}", "type": t} for n, t in services.items()]))
    elif args.count_services:
        print(len(services))
    else:
        for name, type_name in services.items():
            print(f"/{name} [{type_name}]" if args.show_types else f"/{name}")
    return 0


def _type(args: argparse.Namespace) -> int:
    with open_node(args) as node:
        ends = find_ends(node, args.name, KINDS, "service")
    types = types_of(ends, "srv")
    print(json.dumps(types) if args.json else "\n".join(types))
    return 0


def _call(args: argparse.Namespace) -> int:
    from actionlib_core.service_proxy import ServiceProxy

    type_name, text = _words(args)
    with open_node(args, settle=0.0 if type_name else SETTLE_S) as node:
        service = _service_class(node, args.name, type_name)
        request = service._request_class.from_yaml(text)
        proxy = ServiceProxy(args.name, service, timeout=args.timeout, node=node)
        _note(args, "waiting for service to become available...")
        proxy.wait_for_service(args.timeout)
        while True:
            _note(args, f"requester: making request: {request!r}\n")
            try:
                response = proxy(request)
            except ServiceException as error:
                print(f"actionlib: {error}", file=sys.stderr)
                return EXIT_FAILED
            if args.json:
                print(json.dumps(response.to_dict()), flush=True)
            else:
                print(f"response:\n{response!r}\n", flush=True)
            if not args.rate:
                return 0
            node.clock.sleep(1.0 / args.rate)


def _words(args: argparse.Namespace) -> tuple[str, str]:
    """Return type and YAML; either may be left out, YAML is what is no type's name."""
    words = list(args.words)
    type_name = words.pop(0) if words and "{" not in words[0] and ":" not in words[0] else ""
    text = words.pop(0) if words else ""
    if words:
        raise UsageError(
            f"service call: got {words[0]!r} beyond type and request; expected at most two words. "
            "Try quotes around the request: '{data: true}'."
        )
    return type_name, sys.stdin.read() if args.stdin else text


def _service_class(node: Node, name: str, type_name: str) -> type[ServiceType]:
    from actionlib_core.interfaces import get_service

    if not type_name:
        ends = find_ends(node, name, KINDS, "service")
        type_name = only_type(ends, name, "service")
    return known(get_service, type_name)


def _note(args: argparse.Namespace, text: str) -> None:
    if not args.json:
        print(text, flush=True)
