"""Real ROS 1 robots: a bridge between their ROS master and our network, without ROS installed.

    from actionlib_core import ros1

    with ros1.bridge("http://robot:11311", actions={"move_base": "move_base_msgs/MoveBaseAction"}):
        ...  # the robot's move_base has a server here

`smachpy bridge ros1` is the same as a program of its own.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from actionlib_core._arguments import check_seconds
from actionlib_core.clock import RealClock
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import InterfaceError, NameSetupError, Ros1Error
from actionlib_core.names import check_name, clean_namespace
from actionlib_core.node import Node, get_node, has_node
from actionlib_core.wire.ros1.bridge import Ros1Bridge
from actionlib_core.wire.ros1.node import check_master
from actionlib_core.wire.ros1.plan import Wanted

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

__all__ = ["DEFAULT_MASTER", "Ros1Bridge", "Ros1Error", "bridge"]

DEFAULT_MASTER = "http://localhost:11311"
MASTER_VARIABLE = "ROS_MASTER_URI"


def bridge(
    master: str | None = None,
    *,
    actions: Mapping[str, str] | Iterable[str] = (),
    topics: Iterable[str] = (),
    services: Iterable[str] = (),
    used: bool = False,
    all: bool = False,  # noqa: A002  as the option is called
    on_demand: bool = False,
    leave_out: Iterable[str] = (),
    namespace: str = "",
    host: str = "",
    status_timeout: float = 5.0,
    service_timeout: float = 600.0,
    config: Config | str | Path | None = None,
) -> Ros1Bridge:
    """Start a bridge; it runs until it is closed, or its node is.

    Args:
        master: Address of the robot's master; None takes `ROS_MASTER_URI`, else this computer's.
        actions: Actions by their names in ROS 1, with their types if given as a mapping; a type
            that is "" or not given is learned from whoever is there first.
        topics: Topics by their names in ROS 1; their types are learned.
        services: Services by their names in ROS 1; their types are learned.
        used: Bridge also all actions of the robot, all its services but those for logs, and the
            topics that programs on our network use.
        all: Bridge everything that there is on both sides, but `/rosout`.
        on_demand: Bridge also the actions and topics that programs on our network have an end of,
            and the services that this program calls or waits for, as soon as they do.
        leave_out: Names in ROS 1 that are not bridged, whatever else is asked; `*` stands for any
            characters.
        namespace: What the robot's names live under here, "robot_1"; "" is nothing.
        host: Name or address under which the robot finds this computer; "" takes `ROS_HOSTNAME`,
            then `ROS_IP`, then the address from which its master is reached.
        status_timeout: An action server in ROS 1 whose status lists stop for so long is gone [s].
        service_timeout: Longest time of a service call through the bridge [s].
        config: How to join our network, or the file that says it; None joins that of the default
            node, or of `SMACHPY_CONFIG`. The bridge has a node and a session of its own.

    Returns:
        The bridge; a master that is not there yet is waited for (`wait_for_master`).

    Raises:
        NameSetupError: a name breaks the ROS rules; all of them are named.
        InterfaceError: the type of an action is no name of one.
        InvalidDurationError: a time-out is no time, or negative.
        Ros1Error: the master's address cannot be used.
        ConfigError: the configuration has errors.
        TransportError: our network cannot be joined.

    Threads: the bridge's own; it never calls back.
    """
    where = "ros1.bridge"
    given = dict(actions) if isinstance(actions, Mapping) else dict.fromkeys(actions, "")
    topics, services = tuple(topics), tuple(services)
    problems = []
    for kind, names in (("action", given), ("topic", topics), ("service", services)):
        for name in names:
            try:
                check_name(name, f"{kind} name")
            except NameSetupError as error:
                problems.append(str(error))
    if problems:
        raise NameSetupError(*problems)
    wanted = Wanted(
        {_full(name): _action_type(name, type_name) for name, type_name in given.items()},
        frozenset(map(_full, topics)),
        frozenset(map(_full, services)),
        used=used,
        all=all,
        on_demand=on_demand,
        leave_out=tuple(leave_out),
    )
    address = check_master(master or os.environ.get(MASTER_VARIABLE) or DEFAULT_MASTER)
    times = [
        check_seconds(where, name, value)
        for name, value in (
            ("status_timeout", status_timeout),
            ("service_timeout", service_timeout),
        )
    ]
    space = clean_namespace(namespace)
    node = Node(f"ros1_bridge_{os.getpid()}", config=_config(config), clock=RealClock())
    try:
        return Ros1Bridge(
            node,
            address,
            wanted,
            namespace=space,
            host=host,
            status_timeout=times[0],
            service_timeout=times[1],
        )
    except BaseException:
        node.close()
        raise


def _config(config: Config | str | Path | None) -> Config:
    """Return how to join the network: as was said, as the default node has, or as configured."""
    joined = (
        getattr(get_node().transport, "config", None) if config is None and has_node() else None
    )
    return load_config(config) if joined is None else joined


def _full(name: str) -> str:
    return f"/{name.lstrip('/')}"


def _action_type(name: str, type_name: str) -> str:
    """Return "pkg/XAction" of what a user may call it: "pkg/X", "pkg/action/X", "pkg/XAction"."""
    from actionlib_core.interfaces._registry import parse_name

    if not type_name:
        return ""
    try:
        package, _, short = parse_name(type_name)
    except InterfaceError as error:
        raise InterfaceError(
            f"action {name!r}: {error}. Try move_base_msgs/MoveBaseAction."
        ) from error
    return f"{package}/{short.removesuffix('Action')}Action"
