"""Real ROS 1 robots: a bridge between their ROS master and our network, without installing ROS.

    from actionlib_core import ros1

    with ros1.bridge("http://robot:11311", actions={"move_base": "move_base_msgs/MoveBaseAction"}):
        ...  # the robot's move_base has a server here

The command `smachpy bridge ros1` does the same. The bridge is a ROS 1 node, made from parts of the
standard library. Pure: `frames` (the bytes of TCPROS), `answers` (the values of the XML-RPC
interfaces), `publishers` (the publishers of a topic, from answers and updates that may overtake
each other), `goals` (the goals of a bridged action), `backoff` (times of repetitions), `plan` (the
names to bridge). With threads and sockets: `links` (TCP connections), `rpc` (XML-RPC), `node` (a
ROS 1 node), `topics`, `services`, `actions` (one bridged name each), `bridging` (all of them).

Source:
    https://wiki.ros.org/ROS/TCPROS, https://wiki.ros.org/ROS/Connection%20Header,
    https://wiki.ros.org/ROS/Master_API and https://wiki.ros.org/ROS/Slave_API.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from actionlib_core.clock import RealClock
from actionlib_core.config import Config, load_config
from actionlib_core.exceptions import InterfaceError, NameSetupError, Ros1Error
from actionlib_core.inputs.arguments import check_seconds
from actionlib_core.names import check_name, clean_namespace
from actionlib_core.node import Node, get_node, has_node
from actionlib_core.ros1.bridging import Ros1Bridge
from actionlib_core.ros1.node import check_master
from actionlib_core.ros1.plan import Wanted

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
        master: Address of the robot's master; None: `ROS_MASTER_URI`, or else this computer's.
        actions: Actions by their names in ROS 1, with their types if given as a mapping. Without a
            type, or with "", the type of the first end found is used.
        topics: Topics by their names in ROS 1; their types are those of the first end found.
        services: Services by their names in ROS 1; likewise.
        used: Bridge also all actions of the robot, all its services except those for logs, and the
            topics that programs on our network use.
        all: Bridge everything on both sides, except `/rosout`.
        on_demand: Bridge also the actions and topics of which programs on our network have an end,
            and the services that this program calls or waits for, as soon as they do.
        leave_out: Names in ROS 1 that are never bridged; `*` matches any characters.
        namespace: Prefix of the robot's names here, "robot_1"; "": none.
        host: Name or address under which the robot finds this computer; "": `ROS_HOSTNAME`, or
            `ROS_IP`, or the address from which the master is reached.
        status_timeout: A ROS 1 action server without status lists for this time is gone [s].
        service_timeout: Longest time of a service call through the bridge [s].
        config: How to join our network, or a configuration file; None: as the default node, or by
            `SMACHPY_CONFIG`. The bridge has a node and a session of its own.

    Returns:
        The bridge, which waits for the master if necessary (`wait_for_master`).

    Raises:
        NameSetupError: names break the ROS rules; the text lists all of them.
        InterfaceError: the type of an action is not a type name.
        InvalidDurationError: a timeout is not a duration, or negative.
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
    """Return the given configuration, that of the default node, or that of the environment."""
    joined = (
        getattr(get_node().transport, "config", None) if config is None and has_node() else None
    )
    return load_config(config) if joined is None else joined


def _full(name: str) -> str:
    return f"/{name.lstrip('/')}"


def _action_type(name: str, type_name: str) -> str:
    """Return "pkg/XAction" for each way to write it: "pkg/X", "pkg/action/X", "pkg/XAction"."""
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
