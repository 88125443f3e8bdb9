"""The ROS 2 networks that a node of this program uses: the names on each, and their sessions."""

from __future__ import annotations

import itertools
import weakref
from collections import deque
from typing import TYPE_CHECKING, cast

from actionlib_core.config import Ros2
from actionlib_core.exceptions import ConfigError, TransportError
from actionlib_core.interfaces.ros2 import default_distro
from actionlib_core.names import clean_namespace
from actionlib_core.node import open_zenoh
from actionlib_core.transport._keys import key_matches
from actionlib_core.wire.ros2.graph import RosNode, RosType
from actionlib_core.wire.ros2.names import HASH_NOT_SUPPORTED
from actionlib_core.wire.ros2.parameters import serve_parameters

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from actionlib_core.config import Distro
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Transport

# The default of rmw_zenoh. It is not infinite, because Zenoh keeps 0.8 kB for each query until its
# time is over, even when it was answered or cancelled. A request that ends without an answer is
# repeated.
ANSWER_S = 600.0
MANY = 10_000  # requests within that time; beyond this number, each has less time
MIN_ANSWER_S = 30.0

_ids: weakref.WeakKeyDictionary[Transport, Iterator[int]] = weakref.WeakKeyDictionary()
"""Count the nodes and endpoints of each session, which several nodes may share."""


def choose_network(networks: Sequence[Ros2], name: str) -> Ros2:
    """Return the network for the full name `name`.

    Without any setting it is the network that this program has joined anyway, in ROS domain 0, of
    the default distribution. Of several networks it is the first whose robot or patterns match the
    name, else the one that has neither.

    Raises:
        ConfigError: there are several, and the name belongs to none of them.
    """
    if len(networks) <= 1:
        return networks[0] if networks else Ros2(distro=cast("Distro", default_distro()))
    for network in networks:
        if is_named(network, name):
            return network
    for network in networks:
        if not (network.robot or network.names):
            return network
    raise ConfigError(
        "ros2",
        f"names: got {name!r}, which is on none of the {len(networks)} networks; expected a name "
        "of one of them. Try adding it to 'names', or a network without 'names' and 'robot'.",
    )


def is_named(network: Ros2, name: str) -> bool:
    """Return whether the settings of a network claim the full name `name`."""
    if any(entry.name == name for entry in network.map):
        return True
    robot = clean_namespace(network.robot)
    patterns = (f"{robot}/**", *network.names) if robot else network.names
    return any(key_matches(pattern, name) for pattern in patterns)


def name_there(network: Ros2, name: str) -> str:
    """Return the name on a network of the full name `name` here, without a slash in front."""
    robot, namespace = clean_namespace(network.robot), clean_namespace(network.namespace)
    if robot:
        name = name.removeprefix(f"{robot}/")
    if not namespace or name.startswith(f"{namespace}/"):
        return name
    return f"{namespace}/{name}"


def name_here(network: Ros2, name: str) -> str:
    """Return the full name here of the name `name` on a network; the inverse of `name_there`."""
    robot, namespace = clean_namespace(network.robot), clean_namespace(network.namespace)
    if namespace:
        name = name.removeprefix(f"{namespace}/")
    return f"{robot}/{name}" if robot else name


class RosNetwork:
    """A ROS 2 network as one node of this program uses it.

    Attributes:
        settings: The network's settings in the configuration.
        ros: The node on that network; visible from the beginning, with its parameter services.

    Args:
        node: The node of this program; the network is left when it closes.
        settings: See above.

    Raises:
        TransportError: the network cannot be joined.

    Blocks: while it opens the session, if the network has its own.
    """

    def __init__(self, node: Node, settings: Ros2) -> None:
        self.settings = settings
        # A node that was given its transport (in memory, for tests) uses it for ROS 2 as well.
        owned = bool(settings.router) and node.owns_transport
        transport = _join(node, settings) if owned else node.transport
        self._owned = transport if owned else None
        self._parameters: list[Closable] = []
        self._asked: deque[float] = deque(maxlen=MANY)  # when requests were sent [s, clock]
        try:
            ids = _ids.setdefault(transport, itertools.count())
            name = node.full_name
            self.ros = RosNode(
                transport, node.clock, domain=settings.domain, full_name=name, ids=ids
            )
            self.ros.show()
            self._parameters = serve_parameters(self.ros, settings.distro)
            node.on_close(self._close)
        except BaseException:
            self._close()
            raise

    @property
    def transport(self) -> Transport:
        """The session on that network."""
        return self.ros.transport

    def patience(self) -> float:
        """Return how long a request about a goal, which is sent now, waits for its answer [s].

        When there are many, their answers come quickly, and they would fill the memory.
        """
        now = self.ros.clock.now()
        asked = self._asked
        many = len(asked) == MANY and asked[0] > now - ANSWER_S
        asked.append(now)
        return MIN_ANSWER_S if many else ANSWER_S

    def name(self, name: str) -> str:
        """Return the name there of the full name `name` here."""
        return name_there(self.settings, name)

    def type(self, type_name: str, type_hash: str) -> RosType:
        """Return a type as tokens contain it; Humble has no hashes."""
        humble = self.settings.distro == "humble"
        return RosType(type_name, HASH_NOT_SUPPORTED if humble else type_hash)

    def _close(self) -> None:
        if self._owned is not None:  # closing the session withdraws everything in it
            self._owned.close()
        elif hasattr(self, "ros"):  # not yet there when `__init__` has failed
            for declared in reversed(self._parameters):
                declared.close()
            self.ros.close()


def ros_network(node: Node, name: str) -> RosNetwork:
    """Return the ROS 2 network of the full name `name`; it is joined when it is first needed.

    Raises:
        ConfigError: the name is on no network.
        TransportError: the network cannot be joined.

    Blocks: the first time, until the network is joined: `Config.connect_timeout` at most.
    """
    return network_of(node, choose_network(node.config.ros2, name))


def network_of(node: Node, settings: Ros2) -> RosNetwork:
    """Return a node's network with these settings; raises and blocks as `ros_network`."""
    return node.shared(("ros2", settings), lambda: RosNetwork(node, settings))


def _join(node: Node, settings: Ros2) -> Transport:
    try:
        return open_zenoh(node.config.for_ros2(settings))
    except TransportError as error:
        raise TransportError(
            f"ros2: {error} The router of a ROS 2 robot is started there with 'ros2 run "
            "rmw_zenoh_cpp rmw_zenohd'; its firewall has to let the port through."
        ) from error
