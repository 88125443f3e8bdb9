"""`smachpy doctor`: whether a ROS 2 robot can be used from here, and how large a journal is."""

from __future__ import annotations

import contextlib
import json
import os
from typing import TYPE_CHECKING, Any

from actionlib_core.command_line.ros2_options import add_ros2_options, ros2_of_options
from actionlib_core.config import ROS2_VARIABLE, ROUTER_ENDPOINT, load_config
from actionlib_core.exceptions import ConfigError, TransportError
from actionlib_core.process.output import printable
from smachpy.command.pruning import size_text
from smachpy.durable.opening import open_store
from smachpy.durable.store import store_name

if TYPE_CHECKING:
    import argparse

    from actionlib_core.config import Ros2
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Reply
    from actionlib_core.wire.ros2.diagnosis import Finding
    from actionlib_core.wire.ros2.names import Token
    from actionlib_core.wire.ros2.network import RosNetwork

EXIT_PROBLEM = 1
LARGE_JOURNAL = 2**30
"""A journal of so many bytes is noted."""
LIST_S = 2.0  # [s] for the list of the robot's nodes
ASK_S = 2.0  # [s] for the nodes' answers
PARAMETERS = "rcl_interfaces/srv/GetParameters"


def register(subparsers: Any) -> None:
    """Add `smachpy doctor`."""
    parser = subparsers.add_parser(
        "doctor",
        help="diagnose the connection to a ROS 2 robot, and the size of a journal",
        description="Look at a ROS 2 robot whose middleware is rmw_zenoh: router, nodes, type "
        "hashes, actions, quality of service, answers, clock. With --durable, look at a journal of "
        "missions: its size. Exit codes: 0 no problems, 1 problems, 2 bad input.",
        epilog="example: smachpy doctor --ros2 tcp/robot.local:7447 --domain 42",
    )
    # `--ros2` needs no value here: this command has nothing else to check.
    add_ros2_options(parser, nargs="?", const=os.environ.get(ROS2_VARIABLE) or ROUTER_ENDPOINT)
    parser.add_argument(
        "--durable", metavar="JOURNAL", help="look at a file, or postgresql://HOST/DATABASE"
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    found: list[tuple[str, Finding]] = []  # with what was looked at
    if args.durable is not None:
        found.append((store_name(args.durable), look_at_journal(args.durable)))
    with ros2_of_options(args):
        config = load_config()
        if not (config.ros2 or found):
            raise ConfigError(
                "doctor",
                f"got no robot; expected its router. Try --ros2 tcp/robot.local:7447, "
                f"{ROS2_VARIABLE} or 'ros2' in the configuration file.",
            )
        if config.ros2:
            from actionlib_core.node import Node

            with Node(f"doctor_{os.getpid()}", config=config) as node:
                for one in config.ros2:
                    found += [(one.router, finding) for finding in look_at(node, one)]
    if args.json:
        print(json.dumps([{"router": where, **f._asdict()} for where, f in found]))
    else:
        _print(found)
    return EXIT_PROBLEM if any(f.level == "problem" for _, f in found) else 0


def look_at_journal(journal: str) -> Finding:
    """Return how large a journal of missions is.

    Raises:
        StoreError: it cannot be read.

    Blocks: until the store has answered.
    """
    from actionlib_core.wire.ros2.diagnosis import Finding, Level

    with contextlib.closing(open_store(journal, create=False)) as store:
        missions, size = store.size()
    text = f"{store_name(journal)}: {missions} missions, {size_text(size)}"
    if size < LARGE_JOURNAL:
        return Finding(Level.OK, "journal", text)
    way_out = "old missions can be deleted: smachpy missions prune --older-than 30d --keep failed"
    return Finding(Level.NOTE, "journal", text, way_out)


def _print(findings: list[tuple[str, Finding]]) -> None:
    for _, (level, what, text, way_out) in findings:
        print(printable(f"{level:8} {what:8} {text}"))
        if way_out:
            print(printable(f"{'':17} -> {way_out}"))


def look_at(node: Node, settings: Ros2) -> list[Finding]:
    """Return the findings for one network; if nothing more can be seen, the last one says why.

    Blocks: until the router and the nodes have answered, `LIST_S` and `ASK_S` at most.
    """
    from actionlib_core.wire.ros2 import diagnosis
    from actionlib_core.wire.ros2.diagnosis import Finding, Level
    from actionlib_core.wire.ros2.names import ROOT, parse_token
    from actionlib_core.wire.ros2.network import network_of

    where = settings.router or "the network of this program"
    try:
        network = network_of(node, settings)
    except TransportError as error:
        return [Finding(Level.PROBLEM, "router", f"{where}: not reached", str(error))]
    findings = [Finding(Level.OK, "router", f"{where} answers")]
    keys = network.transport.list_alive(f"{ROOT}/**", LIST_S)
    tokens = [token for key in sorted(keys) if (token := parse_token(key)) is not None]
    others = [token for token in tokens if token.session != network.transport.session_id]
    findings.append(diagnosis.diagnose_nodes(others, settings.domain))
    here = [token for token in others if token.domain == settings.domain]
    if not here:
        return findings
    findings += diagnosis.diagnose_types(here, settings.distro)
    findings += diagnosis.diagnose_actions(here)
    findings += diagnosis.diagnose_qos(here)
    return findings + _ask(node, network, here)


def _ask(node: Node, network: RosNetwork, tokens: list[Token]) -> list[Finding]:
    """Ask each node for an empty list of parameters, to see its delay and its clock."""
    from actionlib_core.interfaces import ros2
    from actionlib_core.wire.ros2 import diagnosis
    from actionlib_core.wire.ros2.graph import RosType
    from actionlib_core.wire.ros2.names import Kind

    asked = {t.full_node: t for t in tokens if t.kind is Kind.SERVICE and t.type == PARAMETERS}
    if not asked:
        return []
    request: Any = ros2.get_service(PARAMETERS, network.settings.distro).Request()
    news = node.clock.event()
    answers: dict[str, tuple[int, Reply]] = {}
    over: list[str] = []
    started = node.clock.time_ns()

    def ask(name: str, token: Token) -> Closable:
        def on_reply(reply: Reply) -> None:
            if not reply.error:
                answers.setdefault(name, (node.clock.time_ns(), reply))

        def on_done() -> None:
            over.append(name)
            if len(over) == len(asked):
                news.set()

        end = network.ros.end(Kind.CLIENT, token.name, RosType(token.type, token.type_hash))
        return network.transport.query(
            end.key,
            request.to_cdr(),
            attachment=end.attachment(),
            best=True,
            timeout=ASK_S,
            on_reply=on_reply,
            on_done=on_done,
        )

    queries = [ask(name, token) for name, token in asked.items()]
    news.wait(ASK_S + 1.0)
    for query in queries:
        query.close()
    seconds = {name: (at - started) / 1e9 for name, (at, _) in answers.items()}
    findings = [diagnosis.diagnose_answers({name: seconds.get(name) for name in asked})]
    # As in NTP: the reply was sent half-way between question and answer, give or take half the
    # delay.
    offsets = {
        name: ((there - (started + at) / 2) / 1e9, (at - started) / 2e9)
        for name, (at, reply) in answers.items()
        if (there := _time_in(reply))
    }
    return [*findings, diagnosis.diagnose_clock(offsets)] if offsets else findings


def _time_in(reply: Reply) -> int:
    """Return when a node sent its reply, by its own clock [ns since 1970]; 0 if unknown."""
    from actionlib_core.wire.ros2.attachment import unpack_attachment

    try:
        return unpack_attachment(reply.attachment).time_ns
    except ValueError:
        return 0
