"""`smachpy view`: shows every running machine in a browser."""

from __future__ import annotations

import contextlib
import ipaddress
import os
import signal
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import SerialExecutor
from actionlib_core.command_line.numbers import between
from actionlib_core.command_line.ros2_options import add_ros2_options, ros2_of_options
from actionlib_core.process.output import printable, tell
from actionlib_core.shutdown import EXIT_SIGNAL
from smachpy.command import UsageError
from smachpy.command.durable import JOURNAL
from smachpy.command.pruning import add_keep, age
from smachpy.command.queued import add_allow

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator, Sequence

    from actionlib_core.node import Node
    from smachpy_viz.live.actions import Actions
    from smachpy_viz.live.machines import Machines
    from smachpy_viz.live.network import Network
    from smachpy_viz.runs.statistics import StatisticsOfFiles

EXAMPLES = """examples:
  smachpy view                         every machine on this network, and your private runs
  smachpy view --control               with pause, step, jump, preempt, and goals to actions
  smachpy view run.jsonl               a recorded run
  smachpy view --map office.yaml       with this map, if the robot publishes none
  smachpy view --host 0.0.0.0 --qr     for others on this network; a phone reads the address
  smachpy view --runs runs/            with the statistics of recorded runs in the diagram
  smachpy view --durable postgresql://db/missions    with the missions of this database
"""
PORT = 8080
HIGHEST_PORT = 65_535
MAX_NETWORKS: Final = 20
"""Private networks that are joined; any program of this computer can announce one."""

LEAVE_S: Final = 2.0
"""Longest wait at the end for leaving all networks [s]."""


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    import argparse

    parser = subparsers.add_parser(
        "view",
        help="watch running machines in a browser",
        description="Serve a page that shows every machine on the network while it runs.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("files", metavar="FILE", nargs="*", help="recorded runs to show as well")
    parser.add_argument(
        "--host", default="127.0.0.1", help="address to listen on (default: %(default)s)"
    )
    parser.add_argument(
        "--port",
        type=between(0, HIGHEST_PORT),
        default=PORT,
        help="0 for any free port (default: %(default)s)",
    )
    parser.add_argument(
        "--qr", action="store_true", help="also print the address as a QR code, for a phone"
    )
    parser.add_argument(
        "--auto-focus", action="store_true", help="pages follow the active states from the start"
    )
    parser.add_argument(
        "--control", action="store_true", help="allow commands, with the token in the address"
    )
    parser.add_argument(
        "--token-for-reading",
        action="store_true",
        help="show nothing without a token, which is in the printed address",
    )
    parser.add_argument(
        "--runs", metavar="DIR", action="append", default=[], help="recorded runs for statistics"
    )
    parser.add_argument(
        "--durable",
        metavar="JOURNAL",
        action="append",
        default=[],
        help="durable missions to list: a file, or postgresql://HOST/DATABASE; "
        f"{JOURNAL} is listed if it exists",
    )
    parser.add_argument(
        "--map",
        type=Path,
        metavar="FILE",
        help="a map_server YAML file, used if the robot publishes no map",
    )
    parser.add_argument(
        "--mission",
        metavar="MISSION",
        action="append",
        default=[],
        help="a mission that the page may simulate besides the installed ones: a .py file or "
        "module:factory",
    )
    parser.add_argument(
        "--prune",
        type=age,
        metavar="AGE",
        help="each hour, delete recordings in these folders that are so old: 30d, 12h",
    )
    add_keep(parser, "recordings")
    add_allow(parser, "Resume and Reproduce may run missions of this place, too")
    add_ros2_options(parser)
    parser.add_argument("--tui", action="store_true", help="show it in this terminal instead")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.set_defaults(run=_run)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def _run(args: argparse.Namespace) -> int:
    if args.qr and _is_loopback(args.host):
        raise UsageError(
            f"smachpy view: --qr: got --host {args.host}, which only this computer can open; "
            "expected an address on the network. Try --host 0.0.0.0"
        )
    if args.tui and not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError(
            "smachpy view: --tui: got no terminal for input and output; expected one, for keys and "
            "colours. Over ssh, try: ssh -t HOST smachpy view --tui"
        )
    from actionlib_core.node import get_node
    from smachpy_viz.live.actions import Actions
    from smachpy_viz.live.machines import Machines
    from smachpy_viz.live.network import Network
    from smachpy_viz.runs.floor import read_floor
    from smachpy_viz.runs.statistics import StatisticsOfFiles

    # Files first: errors in them should not wait for the network.
    machines = Machines(None if args.map is None else read_floor(args.map))
    _load(machines, args.files, terminal=args.tui)
    runs = StatisticsOfFiles(args.runs)
    with ros2_of_options(args):
        node = get_node()
    network = Network(node, machines, control=args.control)
    actions = None if args.tui else Actions(node)
    try:
        with private_runs(node, [network] if actions is None else [network, actions]):
            if actions is None:
                return _show_in_terminal(machines, network, control=args.control)
            return _serve(args, machines, runs, network, actions)
    finally:
        if actions is not None:
            actions.close()
        network.close()


def _serve(
    args: argparse.Namespace,
    machines: Machines,
    runs: StatisticsOfFiles,
    network: Network,
    actions: Actions,
) -> int:
    from smachpy.command.runs_folder import runs_folder
    from smachpy_viz.live.app import Viewer
    from smachpy_viz.live.journals import Journals
    from smachpy_viz.live.reproductions import Reproductions
    from smachpy_viz.live.runs import Runs
    from smachpy_viz.live.security import make_token
    from smachpy_viz.live.server import PageServer
    from smachpy_viz.live.simulations import Simulations
    from smachpy_viz.runs.pruning import Pruning

    token = make_token() if args.control else None
    read_token = make_token() if args.token_for_reading else None
    folder = runs_folder()
    journals = Journals(args.durable, Path(JOURNAL), folder.parent / "resumed", args.allow)
    simulations = Simulations(folder.parent / "simulated", args.mission)
    folders = [folder, *(Path(place) for place in args.runs)]
    listed = Runs(machines, folders, journals)
    reproductions = Reproductions(machines, listed.file_of, args.allow)
    viewer = Viewer(
        machines,
        token=token,
        read_token=read_token,
        send=network.send if token else None,
        follow=args.auto_focus,
        statistics=runs.of,
        hosts=(args.host,),
        actions=actions,
        value=network.value,
        picture=network.picture,
        runs=listed,
        home=not args.child and not args.files,
        simulations=simulations,
        reproductions=reproductions,
    )
    # The server already listens when the address is printed, so it can be opened at once.
    server = PageServer(viewer, args.host, args.port)
    # Behind "#", a browser keeps the token to itself: it is in no request and no server's log.
    view = f"#view={read_token}" if read_token else ""
    address = server.address + (f"#token={token}" if token else view)
    print(printable(address), flush=True)
    if token and view:
        print(printable(f"only to watch: {server.address}{view}"), flush=True)
    if args.qr:
        print_qr(address)
    if args.child:
        _end_with_parent(server)
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.closing(journals))
        stack.enter_context(contextlib.closing(simulations))
        stack.enter_context(contextlib.closing(reproductions))
        if args.prune is not None:
            on_text = partial(tell, "smachpy view")
            pruning = Pruning(folders, args.prune, args.keep, on_text)
            stack.enter_context(contextlib.closing(pruning))
        signal_name = server.serve_here()
    return 0 if signal_name is None else EXIT_SIGNAL + signal.Signals[signal_name]


def print_qr(address: str) -> None:
    """Print an address as a QR code for terminals with a dark background."""
    import segno

    segno.make(address, error="l", micro=False).terminal(sys.stdout, compact=True)
    sys.stdout.flush()


@contextlib.contextmanager
def private_runs(node: Node, parts: Sequence[Network | Actions]) -> Iterator[None]:
    """Let `parts` join this user's private networks too, unless the environment names a network.

    Threads: they join and leave in a thread of their own, one network after the other.
    """
    from actionlib_core.config import Config
    from actionlib_core.node import Node
    from actionlib_core.wire.private_network import network_is_chosen, watch_private_networks

    if network_is_chosen():
        yield
        return
    joined: dict[int, Node] = {}  # by domain; only used in the executor's thread
    executor = SerialExecutor(node.clock, "private networks")

    def on_network(domain: int, alive: bool) -> None:
        if alive and domain not in joined and len(joined) < MAX_NETWORKS:
            joined[domain] = Node(f"view_{os.getpid()}", config=Config(domain=domain))
            for part in parts:
                part.join(joined[domain])
        elif not alive and domain in joined:
            for part in parts:  # before its node closes, which they use
                part.leave(joined[domain])
            joined.pop(domain).close()

    watch = watch_private_networks(
        node.transport, lambda domain, alive: executor.submit(lambda: on_network(domain, alive))
    )
    try:
        yield
    finally:
        watch.close()
        for domain in list(joined):
            executor.submit(partial(on_network, domain, alive=False))
        executor.join(LEAVE_S)


def _load(machines: Machines, files: list[str], *, terminal: bool) -> None:
    from smachpy.events.recording import find_recordings, read_recording
    from smachpy_viz.live.runs import read_for_page
    from smachpy_viz.runs.html import MOST_EVENTS

    # Files of the same name in several folders are shown by their paths.
    paths = list(dict.fromkeys(find_recordings(files)))
    names = [path.name for path in paths]
    for path in paths:
        name = path.name if names.count(path.name) == 1 else str(path)
        if terminal:  # which goes through the events again and again
            machines.obtain(name).load(read_recording(path, newest=MOST_EVENTS))
        else:
            machines.load(name, read_for_page(path))


def _end_with_parent(server: Any) -> None:
    """Stop when standard input ends: the system closes it however the parent ends."""
    from actionlib_core.clock import current_clock

    def wait() -> None:
        while sys.stdin.read(1):
            pass
        server.stop()

    current_clock().spawn(wait, name="parent watch")


def _show_in_terminal(machines: Machines, network: Any, *, control: bool) -> int:
    from smachpy_viz.live.tui import MissionApp

    MissionApp(machines, network.send if control else None).run()
    return 0
