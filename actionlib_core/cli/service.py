"""`actionlib service list|call|type`, with the flags of `ros2 service`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import EXIT_FAILED, UsageError
from actionlib_core.cli._command import add_command, json_text, print_progress
from actionlib_core.cli._listing import add_list, add_type
from actionlib_core.cli._network import (
    SERVICE_KINDS,
    class_of_end,
    find_ends,
    only_type,
    open_node,
    typed_class,
    types_of,
)
from actionlib_core.command_line.numbers import rate, seconds
from actionlib_core.exceptions import ServiceException
from actionlib_core.process.output import tell
from actionlib_core.wire.presence import SETTLE_S

if TYPE_CHECKING:
    import argparse


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = subparsers.add_parser("service", help="list and call services")
    verbs = parser.add_subparsers(metavar="VERB", required=True)
    add_list(
        verbs,
        "services",
        SERVICE_KINDS,
        lambda name, ends: {"name": f"/{name}", "type": ", ".join(types_of(ends))},
    )
    add_type(verbs, "a service", SERVICE_KINDS)
    call = add_command(verbs, "call", _call, "call a service and print the response")
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


def _call(args: argparse.Namespace) -> int:
    from actionlib_core.pubsub.service_proxy import ServiceProxy

    type_name, text = _words(args)
    with open_node(args, settle=0.0 if type_name else SETTLE_S) as node:
        if type_name:
            service = typed_class(node, "service", type_name)
        else:
            ends = find_ends(node, args.name, SERVICE_KINDS, args.timeout)
            only_type(ends, args.name)
            service = class_of_end(node, ends[0])
        request = service._request_class.from_yaml(text)
        proxy = ServiceProxy(args.name, service, timeout=args.timeout, node=node)
        print_progress(args, "waiting for service to become available...")
        proxy.wait_for_service(args.timeout)
        while True:
            print_progress(args, f"requester: making request: {request!r}\n")
            try:
                response = proxy(request)
            except ServiceException as error:
                tell("actionlib", str(error))
                return EXIT_FAILED
            shown = json_text(response.to_dict()) if args.json else f"response:\n{response!r}\n"
            print(shown, flush=True)
            if not args.rate:
                return 0
            node.clock.sleep(1.0 / args.rate)


def _words(args: argparse.Namespace) -> tuple[str, str]:
    """Return type and YAML; both are optional, and a word with ':' or '{' is YAML."""
    words = list(args.words)
    type_name = words.pop(0) if words and "{" not in words[0] and ":" not in words[0] else ""
    text = words.pop(0) if words else ""
    if text and args.stdin:
        raise UsageError(
            f"service call: got {text!r} beside --stdin; expected one of the two requests."
        )
    if words:
        raise UsageError(
            f"service call: got {words[0]!r} beyond type and request; expected at most two words. "
            "Try quotes around the request: '{data: true}'."
        )
    return type_name, sys.stdin.read() if args.stdin else text
