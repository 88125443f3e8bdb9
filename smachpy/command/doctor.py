"""`smachpy doctor --ros2`: checks whether a ROS 2 robot can be used from here."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from actionlib_core.config import ROS2_VARIABLE, ROUTER_ENDPOINT, load_config
from actionlib_core.exceptions import ConfigError, TransportError
from actionlib_core.ros2_options import add_ros2_options, ros2_of_options

if TYPE_CHECKING:
    import argparse

    from actionlib_core.config import Ros2
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Reply
    from actionlib_core.wire.ros2.diagnosis import Finding
    from actionlib_core.wire.ros2.names import Token
    from actionlib_core.wire.ros2.network import RosNetwork

EXIT_PROBLEM = 1
LIST_S = 2.0  # [s] for the list of the robot's nodes
ASK_S = 2.0  # [s] for the nodes' answers
PARAMETERS = "rcl_interfaces/srv/GetParameters"


def register(subparsers: Any) -> None:
    """Add `smachpy doctor`."""
    parser = subparsers.add_parser(
        "doctor",
        help="diagnose the connection to a ROS 2 robot",
        description="Look at a ROS 2 robot whose middleware is rmw_zenoh: router, nodes, type "
        "hashes, actions, quality of service, answers, clock. Exit codes: 0 no problems, 1 "
        "problems, 2 bad input.",
        epilog="example: smachpy doctor --ros2 tcp/robot.local:7447 --domain 42",
    )
    # `--ros2` needs no value here: this command has nothing else to check.
    add_ros2_options(parser, nargs="?", const=os.environ.get(ROS2_VARIABLE) or ROUTER_ENDPOINT)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=_run)


def _run(args: argparse.Namespace) -> int:
    with ros2_of_options(args):
        config = load_config()
        if not config.ros2:
            raise ConfigError(
                "doctor",
                f"got no robot; expected its router. Try --ros2 tcp/robot.local:7447, "
                f"{ROS2_VARIABLE} or 'ros2' in the configuration file.",
            )
        from actionlib_core.node import Node

        findings: list[tuple[Ros2, Finding]] = []
        with Node(f"doctor_{os.getpid()}", config=config) as node:
            for settings in config.ros2:
                findings += [(settings, finding) for finding in look_at(node, settings)]
    if args.json:
        print(json.dumps([{"router": s.router, **f._asdict()} for s, f in findings]))
    else:
        _print(findings)
    return EXIT_PROBLEM if any(f.level == "problem" for _, f in findings) else 0


def _print(findings: list[tuple[Ros2, Finding]]) -> None:
    for _, (level, what, text, way_out) in findings:
        print(f"{level:8} {what:8} {text}")
        if way_out:
            print(f"{'':17} -> {way_out}")


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
