"""`actionlib router`: a Zenoh router, for networks without multicast."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._command import add_command

if TYPE_CHECKING:
    from actionlib_core.config import Config


def register(subparsers: Any) -> None:
    """Add the command to an argparse subparsers object."""
    parser = add_command(
        subparsers,
        "router",
        _run,
        "run a router, for networks without multicast",
        description="Runs a zenoh router until Ctrl-C. Programs with mode 'client' or 'peer' and "
        "its endpoint in 'connect' reach each other through it. Without --listen or a "
        "configuration only programs on this computer can connect.",
    )
    parser.add_argument(
        "-l", "--listen", action="append", metavar="ENDPOINT",
        help="be reached at this endpoint, tcp/0.0.0.0:7447 for example (may be given repeatedly)",
    )  # fmt: skip
    parser.add_argument(
        "-e", "--connect", action="append", metavar="ENDPOINT", help="connect to another router"
    )
    parser.add_argument(
        "--config", metavar="FILE", default=argparse.SUPPRESS, help="default: $SMACHPY_CONFIG"
    )


def _run(args: argparse.Namespace) -> int:
    from actionlib_core import shutdown
    from actionlib_core.transport.zenoh import ZenohTransport

    config = _config(args)
    # Before the session is opened, so that a Ctrl-C at any time closes it properly.
    with shutdown.handle_signals():
        transport = ZenohTransport(config)
        try:
            if args.json:
                print(json.dumps({"id": transport.session_id, "listen": list(config.listen)}))
            else:
                listen = ", ".join(config.listen)
                print(f"router {transport.session_id} listens at {listen}; Ctrl-C ends it")
            sys.stdout.flush()
            shutdown.event().wait()
        finally:
            transport.close()
    return 0


def _config(args: argparse.Namespace) -> Config:
    from actionlib_core.config import ROUTER_ENDPOINT, load_config

    config = load_config(args.config)
    changes: dict[str, Any] = {"mode": "router"}
    if args.listen or not config.listen:
        changes["listen"] = tuple(args.listen or (ROUTER_ENDPOINT,))
    if args.connect:
        changes["connect"] = tuple(args.connect)
    return replace(config, **changes)
