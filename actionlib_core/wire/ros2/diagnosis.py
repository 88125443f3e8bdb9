"""Findings about a ROS 2 robot: can it be used from here, and if not, what to try.

Pure functions: they get the tokens and measurements that were collected, and return texts.
"""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces import ros2
from actionlib_core.wire.ros2.names import (
    HASH_NOT_SUPPORTED,
    Kind,
    action_names,
    action_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actionlib_core.wire.ros2.graph import ServerChange
    from actionlib_core.wire.ros2.names import Token

CLOCK_OFF_S = 0.1  # Nav2's usual tolerance for transforms
SLOW_S = 0.5
MAX_NAMED = 5  # names shown in one finding; the rest is counted
START = "ros2 run rmw_zenoh_cpp rmw_zenohd"


class Level(StrEnum):
    """The severity of a finding."""

    OK = "ok"
    NOTE = "note"
    PROBLEM = "problem"


class Finding(NamedTuple):
    """The outcome of one check.

    Attributes:
        level: Its severity.
        what: The check: "router", "nodes", "types", "actions", "qos", "answers", "clock".
        text: What was found.
        way_out: What to try; "" when nothing is wrong.
    """

    level: Level
    what: str
    text: str
    way_out: str = ""


def diagnose_nodes(tokens: Iterable[Token], domain: int) -> Finding:
    """Check whether any node is present in a domain.

    Args:
        tokens: Of all domains.
        domain: The domain to be used.
    """
    by_domain: dict[int, set[str]] = {}
    for token in tokens:
        by_domain.setdefault(token.domain, set()).add(token.full_node)
    nodes = by_domain.pop(domain, set())
    if nodes:
        return Finding(Level.OK, "nodes", f"{_named(nodes)} in domain {domain}")
    if by_domain:
        others = ", ".join(f"{d} ({_named(names)})" for d, names in sorted(by_domain.items()))
        return Finding(
            Level.PROBLEM,
            "nodes",
            f"none in domain {domain}, but in {others}",
            f"Try --domain {min(by_domain)}.",
        )
    return Finding(
        Level.PROBLEM,
        "nodes",
        "none in any domain",
        "Is RMW_IMPLEMENTATION=rmw_zenoh_cpp set where they are started, and do they use this "
        "router? A node of another middleware does not show here.",
    )


def explain_absence(action: str, tokens: Iterable[Token], domain: int, router: str) -> str:
    """Explain why an action has no server: where it was looked for, what is there, what to try.

    Args:
        action: Its full name on the ROS 2 network.
        tokens: Of all domains, without those of this program.
        domain: The domain in use.
        router: The router's address; "" for the network that the program has joined anyway.
    """
    tokens = list(tokens)
    nodes = diagnose_nodes(tokens, domain)
    where = f"router {router}" if router else "the program's own network"
    intro = f"looked at {where} in domain {domain}: "
    if nodes.level is not Level.OK:
        return f"{intro}nodes: {nodes.text}. {nodes.way_out}"
    names = {
        action_of(token.name)
        for token in tokens
        if token.domain == domain and token.kind is Kind.PUBLISHER
    }
    served = sorted(f"/{name}" for name in names if name is not None)
    if f"/{action}" in served:
        return f"{intro}its server shows only a part of it, and is just starting or hangs."
    if not served:
        return f"{intro}{nodes.text}, and no action has a server. Is it started?"
    return f"{intro}actions: {_listed(served)}.{did_you_mean(f'/{action}', served)}"


def explain_mismatch(action: str, change: ServerChange, distro: str) -> TypeMismatchError | None:
    """Return the error about a new server whose types differ from ours; None when they fit.

    Args:
        action: Its full name in this program.
        change: The server, as its tokens describe it.
        distro: The distribution whose definitions are used here.
    """
    if not change.mismatches:
        return None
    first = change.mismatches[0]
    own, found = (first.own.name, first.own.hash), (first.found.name, first.found.hash)
    by = f"action server of node {change.server.node!r}"
    if own[0] != found[0]:
        return TypeMismatchError(action, own, found, by=by)
    fitting = " or ".join(f"'{other}'" for other in ros2.distros_of(*found))
    way_out = (
        f"That is how {fitting} defines it, and this program takes '{distro}'. Try 'distro' in "
        "the configuration, or --distro."
        if fitting
        else "No distribution known here defines it so. Try the robot's own definition, in a "
        "folder that SMACHPY_INTERFACE_PATH names."
    )
    return TypeMismatchError(action, own, found, by=by, way_out=way_out)


def diagnose_types(tokens: Iterable[Token], distro: str) -> list[Finding]:
    """Compare the type hashes of a robot with those of the definitions here.

    Args:
        tokens: Of the robot's endpoints, in its domain.
        distro: The distribution whose definitions are to be used.
    """
    types = {(t.type, t.type_hash) for t in tokens if t.kind is not Kind.NODE}
    if not types:
        return []
    hashes = {type_hash for _, type_hash in types}
    if hashes == {HASH_NOT_SUPPORTED}:
        if distro == "humble":
            note = "Humble shows no type hashes: nobody checks that definitions are the same"
            return [Finding(Level.NOTE, "types", note)]
        text = f"the robot shows no type hashes, as Humble does; expected those of {distro}"
        return [Finding(Level.PROBLEM, "types", text, "Try --distro humble.")]
    # A type may fit several distributions, as most definitions do not change between them. The one
    # that fits most types is the best guess for the robot's.
    fitting: Counter[str] = Counter()
    wrong: list[str] = []
    unknown: list[str] = []
    for name, type_hash in sorted(types):
        found = ros2.distros_of(name, type_hash)
        fitting.update(found)
        if distro not in found:
            (wrong if ros2.is_defined(name, distro) else unknown).append(name)
    findings = []
    if wrong:
        best = max(ros2.DISTROS, key=lambda name: fitting[name])
        better = fitting[best] > fitting[distro]
        findings.append(
            Finding(
                Level.PROBLEM,
                "types",
                f"{len(wrong)} of {len(types)} have another definition than {distro}'s: "
                f"{_listed(wrong)}",
                f"Try --distro {best}, which {fitting[best]} fit."
                if better
                else "Try the definitions of the robot's workspace in SMACHPY_INTERFACE_PATH.",
            )
        )
    else:
        text = f"{len(types) - len(unknown)} have the definitions of {distro}"
        findings.append(Finding(Level.OK, "types", text))
    if unknown:
        findings.append(
            Finding(
                Level.NOTE,
                "types",
                f"{len(unknown)} are not defined here: {_listed(unknown)}",
                "To use them, name the folder of their packages in SMACHPY_INTERFACE_PATH.",
            )
        )
    return findings


def diagnose_actions(tokens: Sequence[Token]) -> list[Finding]:
    """Check that each action has exactly one server, with all its parts."""
    # For each action its servers, by session and node, and the parts that each shows.
    servers: dict[str, dict[tuple[str, int], set[str]]] = {}
    nodes: dict[tuple[str, int], str] = {}
    for token in tokens:
        action = action_of(token.name) if token.kind in {Kind.SERVICE, Kind.PUBLISHER} else None
        if action is not None:
            which = token.session, token.node_id
            nodes[which] = token.full_node
            servers.setdefault(action, {}).setdefault(which, set()).add(token.name)
    findings = []
    for action, ends in sorted(servers.items()):
        whole = [
            nodes[which] for which, names in ends.items() if len(names) == len(action_names(""))
        ]
        if len(whole) > 1:
            findings.append(
                Finding(
                    Level.PROBLEM,
                    "actions",
                    f"/{action} has {len(whole)} servers: {_listed(sorted(whole))}",
                    "A ROS 2 client runs a goal in all of them; stop all but one.",
                )
            )
        elif whole:
            findings.append(Finding(Level.OK, "actions", f"/{action} is served by /{whole[0]}"))
        else:
            findings.append(
                Finding(
                    Level.PROBLEM,
                    "actions",
                    f"/{action}: its server shows {max(map(len, ends.values()))} of 5 parts",
                    "It is just starting, or hangs; look again, then restart that node.",
                )
            )
    if not findings:
        note = "no action has a server"
        return [Finding(Level.NOTE, "actions", note, "Is the robot's navigation started?")]
    return findings


def diagnose_qos(tokens: Iterable[Token]) -> list[Finding]:
    """List the topics that keep messages for late subscribers, and those that may drop messages."""
    topics = {
        token.name: token.qos
        for token in tokens
        if token.kind is Kind.PUBLISHER and token.qos and action_of(token.name) is None
    }
    latched = [f"/{name}" for name, qos in sorted(topics.items()) if qos.latched]
    sensors = [f"/{name}" for name, qos in sorted(topics.items()) if not qos.reliable]
    findings = []
    if latched:
        text = f"latched: {_listed(latched)}"
        findings.append(Finding(Level.OK, "qos", text))
    if sensors:
        text = f"best effort, messages may be lost: {_listed(sensors)}"
        findings.append(Finding(Level.OK, "qos", text))
    return findings


def diagnose_answers(seconds: Mapping[str, float | None]) -> Finding:
    """Check whether all nodes answer, and how fast.

    Args:
        seconds: Time that each node took to answer [s], by its full name; None: no answer.
    """
    silent = sorted(f"/{node}" for node, took in seconds.items() if took is None)
    if silent:
        some = f"{len(silent)} of {len(seconds)} nodes do not answer, though they are there"
        return Finding(
            Level.PROBLEM,
            "answers",
            f"{some}: {_listed(silent)}",
            "They hang or are suspended, or the link is cut: a ROS 2 node is missed only after "
            "a minute. Try restarting them.",
        )
    slowest, took = max(((node, took or 0.0) for node, took in seconds.items()), key=lambda x: x[1])
    level = Level.OK if took < SLOW_S else Level.NOTE
    way_out = "" if level is Level.OK else "The link or the robot is slow."
    text = f"{_named(seconds)}; the slowest, /{slowest}, answers in {took * 1e3:.0f} ms"
    return Finding(level, "answers", text, way_out)


def diagnose_clock(offsets: Mapping[str, tuple[float, float]]) -> Finding:
    """Compare the nodes' clocks with ours.

    Args:
        offsets: By full name of a node: how far its clock is ahead, and the uncertainty of that
            measurement [s].
    """
    # The node whose clock is certainly off the furthest.
    node, (offset_s, error_s) = max(offsets.items(), key=lambda each: abs(each[1][0]) - each[1][1])
    if abs(offset_s) <= CLOCK_OFF_S + error_s:
        text = f"the same within {max(abs(offset_s), error_s) * 1e3:.0f} ms"
        return Finding(Level.OK, "clock", text)
    side = "ahead of" if offset_s > 0 else "behind"
    return Finding(
        Level.PROBLEM,
        "clock",
        f"the clock of /{node} is {abs(offset_s):.1f} s {side} this computer's",
        "Stamps of goals are too old or in the future for the robot, which may wait for transforms "
        "or refuse. Set both clocks by one time service, chrony for example.",
    )


def _named(names: Iterable[str]) -> str:
    found = sorted(names)
    return f"{len(found)} node{'s' if len(found) != 1 else ''}: {_listed([f'/{n}' for n in found])}"


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:MAX_NAMED])
    return shown if len(names) <= MAX_NAMED else f"{shown} and {len(names) - MAX_NAMED} more"


__all__ = [
    "Finding",
    "Level",
    "diagnose_actions",
    "diagnose_answers",
    "diagnose_clock",
    "diagnose_nodes",
    "diagnose_qos",
    "diagnose_types",
    "explain_absence",
    "explain_mismatch",
]
