"""The endpoints on ROS 2 networks, as the command line and the live page list them.

Each is an `Endpoint`, as on our own wire. The servers and clients of an action are recognised by
their endpoint of its feedback topic. Names that ROS 2's tools hide are left out.
"""

from __future__ import annotations

import logging
import threading
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ConfigError, InterfaceError, NodeError, TransportError
from actionlib_core.interfaces import ros2
from actionlib_core.transport.tokens import Endpoint, Kind
from actionlib_core.wire.ros2 import diagnosis
from actionlib_core.wire.ros2.names import Kind as RosKind
from actionlib_core.wire.ros2.names import action_of
from actionlib_core.wire.ros2.network import choose_network, name_here, network_of, ros_network

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.config import Ros2
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable
    from actionlib_core.wire.ros2.names import Token
    from actionlib_core.wire.ros2.network import RosNetwork

log = logging.getLogger(__name__)

AGAIN_S = 5.0  # interval of attempts to join a network
_FEEDBACK = "_FeedbackMessage"


def networks(
    node: Node, name: str | None = None
) -> tuple[list[RosNetwork], list[tuple[Ros2, TransportError]]]:
    """Return the ROS 2 networks in the configuration that can be joined, and errors of the others.

    Args:
        node: The node.
        name: Only the network that has this full name, if one has it; None: all.

    Blocks: the first time, until they are joined, all at the same time: `Config.connect_timeout` at
        most.
    """
    wanted = list(node.config.ros2)
    if name is not None:
        try:
            wanted = [choose_network(wanted, name)] if wanted else []
        except ConfigError:  # the name is on none of them
            return [], []
    found: dict[Ros2, RosNetwork] = {}
    errors: dict[Ros2, TransportError] = {}

    def join(settings: Ros2) -> None:
        try:
            found[settings] = network_of(node, settings)
        except TransportError as error:
            errors[settings] = error

    tasks = [
        node.clock.spawn(partial(join, settings), name="join a network") for settings in wanted[1:]
    ]
    if wanted:
        join(wanted[0])
    for task in tasks:
        task.join()
    return (
        [found[settings] for settings in wanted if settings in found],
        [(settings, errors[settings]) for settings in wanted if settings in errors],
    )


def end_of(network: RosNetwork, token: Token) -> Endpoint | None:
    """Return the endpoint that a token shows; None for a node and for hidden names.

    `Endpoint.md5` holds the type hash.
    """
    action = action_of(token.name)
    name, type_name = token.name, token.type
    if action is not None:
        # Of the five parts of an action only feedback counts: the server publishes it, each client
        # subscribes to it, and its type contains the name of the action's type.
        kinds = {
            RosKind.PUBLISHER: Kind.ACTION_SERVER,
            RosKind.SUBSCRIPTION: Kind.ACTION_CLIENT,
        }
        if not (name.endswith("/feedback") and type_name.endswith(_FEEDBACK)):
            return None
        name, type_name = action, type_name.removesuffix(_FEEDBACK)
    else:
        kinds = {
            RosKind.PUBLISHER: Kind.PUBLISHER,
            RosKind.SUBSCRIPTION: Kind.SUBSCRIBER,
            RosKind.SERVICE: Kind.SERVICE,
        }
    # ROS 2 hides names with a word that begins with an underscore.
    if token.kind not in kinds or any(word.startswith("_") for word in name.split("/")):
        return None
    return Endpoint(
        kinds[token.kind],
        name_here(network.settings, name),
        type_name,
        token.type_hash,
        token.session,
        token.full_node,
        token.entity_id,
    )


def watch_ends(
    node: Node, on_end: Callable[[Endpoint, str, bool], object], name: str | None = None
) -> list[Closable]:
    """Call a function for each endpoint on a node's ROS 2 networks, and for every change.

    A network that cannot be joined is logged, and joined when that is possible.

    Args:
        node: The node.
        on_end: Gets an endpoint, the key of its token, and whether it is there; called on the
            networks' threads, must not wait.
        name: Only on the network that has this full name; None: on all.

    Blocks: as `networks`.
    """
    joined, errors = networks(node, name)
    watches: list[Closable] = [_watch(network, on_end) for network in joined]
    for settings, error in errors:
        log.warning("%s Its names are missing until it can be joined.", error)
        watches.append(_LateWatch(node, settings, on_end))
    return watches


def _watch(network: RosNetwork, on_end: Callable[[Endpoint, str, bool], object]) -> Closable:
    def on_token(token: Token, key: str, alive: bool) -> None:
        end = end_of(network, token)
        if end is not None:
            on_end(end, key, alive)

    return network.ros.watch(on_token)


class _LateWatch:
    """The watch of a network that could not be joined; it tries again every `AGAIN_S`.

    Threads: any.
    """

    def __init__(
        self, node: Node, settings: Ros2, on_end: Callable[[Endpoint, str, bool], object]
    ) -> None:
        self._node = node
        self._settings = settings
        self._on_end = on_end
        self._lock = threading.Lock()
        self._watch: Closable | None = None
        self._closed = False
        self._try_later()

    def close(self) -> None:
        with self._lock:
            self._closed = True
            watch = self._watch
        if watch is not None:
            watch.close()

    def _try_later(self) -> None:
        clock = self._node.clock
        clock.call_later(AGAIN_S, partial(clock.spawn, self._try, name="join a network"))

    def _try(self) -> None:
        if self._closed or self._node.closed:
            return
        try:
            network = network_of(self._node, self._settings)
            watch = _watch(network, self._on_end)
        except TransportError:  # logged before; it may come up at any time
            self._try_later()
            return
        except NodeError:  # the node was closed in the meantime
            return
        log.info("ros2: the network of %s is joined.", self._settings.router)
        with self._lock:
            self._watch = watch
            closed: bool = self._closed
        if closed:  # meanwhile
            watch.close()


def explain_absence(node: Node, full: str) -> str:
    """Return why there may be no server of an action on ROS 2, and what to try.

    "" if the name is on no ROS 2 network. Blocks: as `RosNode.list_others`.
    """
    try:
        network = ros_network(node, full)
    except ConfigError:  # the name is on none of them
        return ""
    settings, there = network.settings, network.name(full)
    others = network.ros.list_others()
    return diagnosis.explain_absence(there, others, settings.domain, settings.router)


def class_of(node: Node, end: Endpoint) -> Any:
    """Return the class of an endpoint's type, if the definition here has the endpoint's hash.

    Raises:
        InterfaceError: there is no definition here, or a different one.
    """
    network = choose_network(node.config.ros2, end.name)
    get: Callable[[str, str], Any] = ros2.get_message
    hashed = end.type
    if end.kind in {Kind.ACTION_SERVER, Kind.ACTION_CLIENT}:
        get, hashed = ros2.get_action, f"{end.type}{_FEEDBACK}"
    elif end.kind is Kind.SERVICE:
        get = ros2.get_service
    found = get(end.type, network.distro)
    own = ros2.hash_of(hashed, network.distro)
    if own != end.md5:
        raise InterfaceError(
            f"'/{end.name}': {mismatch_text(end.type, hashed, (network.distro, own), end.md5)}"
        )
    return found


def mismatch_text(type_name: str, hashed: str, own: tuple[str, str], found: str) -> str:
    """Return the error text for a type that has another hash on the robot.

    Args:
        type_name: The type.
        hashed: The type from which the hash is computed: of an action, its feedback message.
        own: Our distribution, and the hash of its definition.
        found: The hash on the robot.
    """
    if found == ros2.NO_HASH:
        fitting = ["humble"]
    else:
        fitting = [d for d in ros2.distros_of(hashed, found) if d != "humble"]
    way_out = (
        f"Try --distro {fitting[0]}."
        if fitting
        else "Try the definition of the robot's own workspace in SMACHPY_INTERFACE_PATH."
    )
    whose = f"It is that of {', '.join(fitting)}. " if fitting else ""
    return (
        f"{type_name}: got the type hash {found}; expected {own[1]}, that of {own[0]}. "
        f"{whose}{way_out}"
    )
