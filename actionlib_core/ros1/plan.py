"""Decides which names are bridged, from the options and both networks. No threads, no network."""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from actionlib_core.ros1.answers import ACTION_WORDS, SystemState, find_actions
from actionlib_core.transport.tokens import Kind

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from actionlib_core.transport.tokens import Endpoint

_ACTION = {Kind.ACTION_CLIENT, Kind.ACTION_SERVER}
_TOPIC = {Kind.PUBLISHER, Kind.SUBSCRIBER}
_OF_EVERY_NODE = ("get_loggers", "set_logger_level")  # services that every node has
_LOGS = ("/rosout", "/rosout_agg")  # every node publishes its log on the first


@dataclass(frozen=True)
class Wanted:
    """The names to bridge. They are those in ROS 1, with a slash in front.

    Attributes:
        actions: Name -> type "pkg/XAction"; "" when the type is to be learned.
        topics: Names.
        services: Names.
        used: In addition all actions and services of the robot, as programs look for them before
            they use them, and the topics that programs on our network use.
        all: In addition everything on both networks.
        on_demand: In addition the actions and topics that programs on our network use, and the
            actions and services that this program looks for, from their first use on.
        leave_out: Patterns (`fnmatch`) of names that are never bridged.
    """

    actions: Mapping[str, str] = field(default_factory=dict)
    topics: frozenset[str] = frozenset()
    services: frozenset[str] = frozenset()
    used: bool = False
    all: bool = False
    on_demand: bool = False
    leave_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class BridgePlan:
    """The names that are bridged now, as in ROS 1.

    Attributes:
        actions: Name -> type; "" when it is unknown.
        topics: Name -> whether messages from ROS 1 are passed to our network.
        services: Name -> whether a node in ROS 1 serves it.
    """

    actions: dict[str, str]
    topics: dict[str, bool]
    services: dict[str, bool]


def without(state: SystemState, prefix: str) -> SystemState:
    """Return a state without the nodes whose names begin with `prefix`."""

    def of(part: dict[str, list[str]]) -> dict[str, list[str]]:
        kept = {
            name: [n for n in nodes if not n.startswith(prefix)] for name, nodes in part.items()
        }
        return {name: nodes for name, nodes in kept.items() if nodes}

    return SystemState(of(state.publishers), of(state.subscribers), of(state.services))


def make_plan(
    wanted: Wanted,
    ends: Mapping[str, list[Endpoint]],
    state: SystemState,
    types: Mapping[str, str],
    looked_for: Collection[str] = (),
) -> BridgePlan:
    """Decide what is bridged.

    Args:
        wanted: The names that were chosen.
        ends: Name in ROS 1 -> its endpoints on our network, without those of bridges.
        state: The master's registrations, without those of bridges.
        types: Topic -> type, as the master knows it.
        looked_for: Names in ROS 1 of the actions and services that this program looks for.
    """
    shows = wanted.used or wanted.all
    follow = shows or wanted.on_demand
    kinds = {name: {end.kind for end in there} for name, there in ends.items()} if follow else {}
    topics_there = state.publishers.keys() | state.subscribers.keys()
    learned = find_actions(dict(types), topics_there)
    # Actions: those chosen, those with an endpoint here, and those in ROS 1 as the options say. A
    # type that was given counts; else the one that was learned in ROS 1.
    actions = dict(wanted.actions)
    for name, there in kinds.items():
        if there & _ACTION:
            actions.setdefault(name, "")
    if shows:
        actions = {**learned, **actions}
    elif follow:
        actions = {**{name: learned[name] for name in learned.keys() & set(looked_for)}, **actions}
    actions = {name: given or learned.get(name, "") for name, given in actions.items()}
    parts = {f"{name}/{word}" for name in actions for word in ACTION_WORDS}

    # Topics: messages from ROS 1 are needed only if a program here subscribes, or on request.
    topics = dict.fromkeys(wanted.topics, True)
    for name, there in kinds.items():
        if there & _TOPIC:
            topics[name] = topics.get(name, False) or Kind.SUBSCRIBER in there
    if wanted.all:
        topics.update(dict.fromkeys(state.publishers.keys() - set(_LOGS), True))
    services = {
        name for name in state.services if shows and name.rpartition("/")[2] not in _OF_EVERY_NODE
    }
    if wanted.on_demand:
        services |= state.services.keys() & set(looked_for)
    services |= wanted.services | {name for name, there in kinds.items() if Kind.SERVICE in there}

    def goes(name: str) -> bool:
        return not any(fnmatchcase(name, pattern) for pattern in wanted.leave_out)

    # The five topics of an action belong to its bridge and are not bridged once more.
    return BridgePlan(
        {name: type_name for name, type_name in actions.items() if goes(name)},
        {name: listen for name, listen in topics.items() if name not in parts and goes(name)},
        {name: name in state.services for name in services if goes(name)},
    )
