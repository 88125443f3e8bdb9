"""The names, types and goals of ROS 2 robots, for the commands: from tokens and by queries."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from actionlib_core.cli import UsageError
from actionlib_core.exceptions import InterfaceError
from actionlib_core.process.output import tell
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire import absence

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator
    from types import ModuleType

    from actionlib_core.interfaces.ros2 import ServiceParts
    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.transport.tokens import Endpoint
    from actionlib_core.wire.ros2.action_messages import CancelResponse, GoalState
    from actionlib_core.wire.ros2.network import RosNetwork

ASK_S = 2.0  # longest wait for an answer
STATUS_S = 1.0  # longest wait for a server's latched status; one that never had a goal has none


def is_ros2(type_name: str) -> bool:
    """Return whether the type in a token is one of ROS 2: "pkg/kind/Name"."""
    return type_name.count("/") > 1


def _ends() -> ModuleType:
    """Import the module for ROS 2's tokens, which commands without such a robot do not need."""
    from actionlib_core.wire.ros2 import ends

    return ends


# -- ends ------------------------------------------------------------------------------------------


def _networks(node: Node, full: str | None) -> list[RosNetwork]:
    """Return the ROS 2 networks that can be joined: of one full name, or all.

    Raises:
        TransportError: the one of the name cannot be joined. Of all networks, those that cannot are
            named on standard error: the others can be used.

    Blocks: the first time, until they are joined.
    """
    joined, errors = _ends().networks(node, full)
    for settings, error in errors:
        if full is not None:
            raise error
        whose = f"robot '{settings.robot}'" if settings.robot else f"router {settings.router}"
        tell("actionlib", f"the names of {whose} are missing: {error}")
    found: list[RosNetwork] = joined
    return found


def list_ros2_ends(node: Node, full: str | None = None) -> list[Endpoint]:
    """Return the ends on ROS 2 networks, with their names here: of one full name, or all.

    Ends that ROS 2's tools hide are left out, and so are those of the command's own node.

    Raises and blocks: as `_networks`, and until the networks have answered, a second each at most.
    """
    if not node.config.ros2:
        return []
    found = (
        _ends().end_of(network, token)
        for network in _networks(node, full)
        for token in network.ros.list()
        if (token.session, token.node_id) != (network.ros.token.session, network.ros.token.node_id)
    )
    return [end for end in found if end is not None]


@contextlib.contextmanager
def watching(node: Node, full: str, on_end: Callable[[Endpoint], object]) -> Iterator[None]:
    """Call `on_end` for each present and future end on the network of a full name.

    It is called on the network's threads.
    """

    def on_change(end: Endpoint, _key: str, alive: bool) -> None:
        if alive:
            on_end(end)

    with contextlib.ExitStack() as stack:
        for watch in _ends().watch_ends(node, on_change, full) if node.config.ros2 else ():
            stack.callback(watch.close)
        yield


def explain_absence(node: Node, full: str) -> str:
    """Return why there may be no server of an action, and what to try.

    Blocks: as `list_ros2_ends`.
    """
    found: str = _ends().explain_absence(node, full) if node.config.ros2 else ""
    return found or absence.explain_absence(node, full, Kind.ACTION_SERVER)


def subscribe_to_bytes(node: Node, full: str, callback: Callable[[Sample], None]) -> list[Closable]:
    """Receive the bytes of a topic from the present publishers on ROS 2 networks.

    Blocks: until the networks have answered, a second each at most.
    """
    if not node.config.ros2:
        return []
    from actionlib_core.wire.ros2.names import Kind as RosKind
    from actionlib_core.wire.ros2.names import data_key

    keys = {
        (network, data_key(token.domain, token.name, token.type, token.type_hash))
        for network in _networks(node, full)
        for token in network.ros.list(kind=RosKind.PUBLISHER, name=network.name(full))
    }
    return [network.transport.subscribe(key, callback, cached=1) for network, key in keys]


# -- types -----------------------------------------------------------------------------------------


def typed(node: Node, kind: str, name: str) -> Any:
    """Return the ROS 2 class of a type in a command line; None when it is not for ROS 2.

    Args:
        node: The node, whose configuration counts.
        kind: "message", "service" or "action".
        name: "pkg/Name" or "pkg/msg/Name".
    """
    if not node.config.ros2:
        return None
    from actionlib_core.interfaces import ros2

    get: Any = getattr(ros2, f"get_{kind}")
    with contextlib.suppress(InterfaceError):
        return get(name, node.config.ros2[0].distro)
    return None


# -- goals -----------------------------------------------------------------------------------------


class RemoteAction:
    """An action of a ROS 2 robot.

    Args:
        node: The command's node.
        server: The server, from `find_server`.

    Raises:
        InterfaceError: our definition of the action differs.
    """

    def __init__(self, node: Node, server: Endpoint) -> None:
        from actionlib_core.interfaces import ros2_action
        from actionlib_core.wire.ros2.names import action_names
        from actionlib_core.wire.ros2.network import ros_network

        self._node = node
        self._network = ros_network(node, server.name)
        self.parts = ros2_action(_ends().class_of(node, server))
        self.name = server.name
        self._names = action_names(self._network.name(server.name))

    def key(self, part: str) -> str:
        """Return the key of "feedback" or "status"."""
        from actionlib_core.wire.ros2.names import data_key

        topic = getattr(self.parts, part)
        ros_type = self._network.type(topic.type, topic.hash)
        name = getattr(self._names, part)
        return data_key(self._network.settings.domain, name, ros_type.name, ros_type.hash)

    def subscribe(self, part: str, callback: Callable[[Sample], None]) -> Closable:
        """Receive "feedback" or "status", which begins with the last one."""
        return self._network.transport.subscribe(
            self.key(part), callback, history=False, cached=int(part == "status")
        )

    def states(self) -> list[GoalState]:
        """Return the goals that the server tracks.

        Blocks: until its last status list has arrived, `STATUS_S` at most.
        """
        from actionlib_core.wire.ros2.action_messages import unpack_statuses

        samples: list[Sample] = []
        came = self._node.clock.event()

        def on_status(sample: Sample) -> None:
            samples.append(sample)
            came.set()

        subscription = self.subscribe("status", on_status)
        came.wait(STATUS_S)
        subscription.close()
        return unpack_statuses(samples[-1].payload) if samples else []

    def cancel(self, uuid: bytes, stamp_ns: int) -> CancelResponse:
        """Send a cancel to the server; see `CancelRequest`.

        Raises:
            UsageError: no answer came.

        Blocks: `ASK_S` at most.
        """
        from actionlib_core.wire.ros2.action_messages import (
            CancelRequest,
            pack_cancel,
            unpack_cancel_response,
        )

        request = pack_cancel(CancelRequest(uuid, stamp_ns))
        return unpack_cancel_response(self._ask("cancel_goal", self.parts.cancel_goal, request))

    def result(self, uuid: bytes) -> tuple[int, Any]:
        """Return state and result of a goal that has ended; state 0: it is unknown.

        Raises, blocks: as `cancel`.
        """
        from actionlib_core.wire.ros2.action_messages import pack_id

        answer = self._ask("get_result", self.parts.get_result, pack_id(uuid))
        response: Any = self.parts.get_result.response.from_cdr(answer)
        return response.status, response.result

    def _ask(self, part: str, service: ServiceParts, request: bytes) -> bytes:
        from actionlib_core.wire.ros2.names import Kind as RosKind

        ros_type = self._network.type(service.type, service.hash)
        end = self._network.ros.end(RosKind.CLIENT, getattr(self._names, part), ros_type)
        replies: list[Any] = []
        done = self._node.clock.event()
        query = self._network.transport.query(
            end.key,
            request,
            attachment=end.attachment(),
            best=True,
            timeout=ASK_S,
            on_reply=replies.append,
            on_done=done.set,
        )
        done.wait(ASK_S + 1.0)
        query.close()
        for reply in replies:
            if not reply.error:
                payload: bytes = reply.payload
                return payload
        raise UsageError(
            f"action '/{self.name}': got no answer to {part} within {ASK_S:g} s; expected one. Try "
            "again, as a ROS 2 server drops requests when many come at once, or 'smachpy doctor "
            "--ros2'."
        )


def merged(
    own: list[Endpoint], node: Node, kinds: Collection[Kind], full: str | None = None
) -> list[Endpoint]:
    """Return the ends of the given kinds on our own network and on ROS 2 networks.

    With a `full` name, only the network that has it is joined, and only if it is needed.
    """
    here = [end for end in own if end.kind in kinds]
    if full is not None and here:
        return here
    return here + [end for end in list_ros2_ends(node, full) if end.kind in kinds]
