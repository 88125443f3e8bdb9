"""An endpoint of a ROS 2 topic or service: CDR with an attachment, under name, type and hash."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import DeserializationError, FieldError
from actionlib_core.transport import Quality
from actionlib_core.transport.tokens import Endpoint
from actionlib_core.transport.tokens import Kind as EndKind
from actionlib_core.wire.end_port import Sender
from actionlib_core.wire.ros2.attachment import answer_to, unpack_attachment
from actionlib_core.wire.ros2.mapping import message_on_ros2, name_on_ros2, service_on_ros2
from actionlib_core.wire.ros2.names import LATCHED, Kind, parse_token, token_pattern
from actionlib_core.wire.ros2.network import choose_network, name_there, network_of, ros_network

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.node import Node
    from actionlib_core.transport import Closable, Presence, Query, Reply, Sample, Transport
    from actionlib_core.wire.end_port import OnEnd
    from actionlib_core.wire.ros2.mapping import MessageOnRos2
    from actionlib_core.wire.ros2.names import Token

_KINDS = {
    Kind.PUBLISHER: EndKind.PUBLISHER,
    Kind.SUBSCRIPTION: EndKind.SUBSCRIBER,
    Kind.SERVICE: EndKind.SERVICE,
}
_KINDS_THERE = {kind: there for there, kind in _KINDS.items()}


class RosEndPort:
    """An endpoint on a ROS 2 network; see `make_end_port`. With `calls`, a service's client."""

    ages = False  # ROS 2's tokens do not say which endpoint is older

    def __init__(
        self, node: Node, kind: EndKind, name: str, interface: Any, *, calls: bool = False
    ) -> None:
        self._network = network = ros_network(node, name)
        self._clock = node.clock
        self._request: MessageOnRos2
        self._response: MessageOnRos2
        if kind is EndKind.SERVICE:
            theirs, self._request, self._response = service_on_ros2(
                network.settings, name, interface
            )
            there, type_name, type_hash = self._request.name, theirs._type, theirs._rihs01
        else:
            self._message = message_on_ros2(network.settings, name, interface)
            there = self._message.name
            type_name, type_hash = self._message.message._type, self._message.message._rihs01
        self._name_there = network.name(there)
        self._type = network.type(type_name, type_hash)
        self._name = name
        kind_there = Kind.CLIENT if calls else _KINDS_THERE[kind]
        self._end = network.ros.end(kind_there, self._name_there, self._type)
        self.own = self._convert(self._end.token)._replace(kind=kind)
        if calls:
            self._end.show()
            node.on_close(self._end.close)

    def _convert(self, token: Token) -> Endpoint:
        return _endpoint(token, self._name)

    @property
    def transport(self) -> Transport:
        return self._network.transport

    def show(self) -> Closable:
        self._end.show()
        return self._end

    def watch(self, kinds: Collection[EndKind], callback: OnEnd) -> Closable:
        def on_token(token: Token, key: str, alive: bool) -> None:
            if _KINDS.get(token.kind) in kinds:
                callback(key, self._convert(token), alive)

        return self._network.ros.watch(on_token, name=self._name_there)

    def list_services(self) -> list[Endpoint]:
        tokens = self._network.ros.list(kind=Kind.SERVICE, name=self._name_there)
        return [self._convert(token) for token in tokens]

    def explain_absence(self) -> str:
        return ""

    def send(self, *, latch: bool) -> Sender:
        quality = Quality(block=False, cache=LATCHED.depth if latch else 0)
        if latch:
            # The token contains the QoS, and the gid is made from the token: a latched publisher
            # is a new endpoint.
            ros = self._network.ros
            self._end = ros.end(Kind.PUBLISHER, self._name_there, self._type, LATCHED)
            self.own = self._convert(self._end.token)
        end, to_ros2 = self._end, self._message.to_ros2
        port = self._network.transport.publisher(end.key, "", quality)
        lock = threading.RLock()  # a signal's handler may publish while this thread does

        def put(message: Any) -> None:
            payload = to_ros2(message).to_cdr()
            with lock:  # a gap in the numbers, or one too late, is a lost message for a subscriber
                port.put(payload, end.attachment())

        return Sender(put, port.close)

    def receive(self, callback: Callable[[Sample], None], *, latched: bool = True) -> Closable:
        # Asks for kept messages of all publishers: whether one latches is its own choice.
        kept = LATCHED.depth if latched else 0
        return self._network.transport.subscribe(
            self._end.key, callback, history=latched, cached=kept
        )

    def read(self, sample: Sample) -> Any:
        return _read(self._message, sample.payload)

    def sender_of(self, sample: Sample) -> Endpoint:
        return self.own._replace(kind=EndKind.PUBLISHER, session=sample.source, node="", entity=0)

    def answer(self, callback: Callable[[Query], None]) -> Closable:
        return self._network.transport.queryable(self._end.key, callback, complete=True)

    def check(self, query: Query) -> None:
        unpack_attachment(query.attachment)

    def read_request(self, query: Query) -> Any:
        return _read(self._request, query.payload)

    def reply(self, query: Query, response: Any) -> None:
        asked = unpack_attachment(query.attachment)
        payload = self._response.to_ros2(response).to_cdr()
        query.reply(payload, attachment=answer_to(asked, self._clock.time_ns()))

    def ask(
        self,
        request: Any,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        return self._network.transport.query(
            self._end.key,
            self._request.to_ros2(request).to_cdr(),
            attachment=self._end.attachment(),
            best=True,
            timeout=timeout,
            on_reply=on_reply,
            on_done=on_done,
        )

    def read_response(self, reply: Reply) -> Any:
        return _read(self._response, reply.payload)


def _endpoint(token: Token, name: str) -> Endpoint:
    """Return the endpoint that a token describes, as our own wire describes endpoints."""
    return Endpoint(
        _KINDS.get(token.kind, EndKind.SERVICE),
        name,
        token.type,
        token.type_hash,
        token.session,
        token.full_node,
        token.entity_id,
    )


def watch_any_type(node: Node, name: str, callback: OnEnd) -> Closable:
    """Watch the services of a name on its ROS 2 network, whatever their type; as `EndPort.watch`.

    Without a configured network, it is the one that the program has joined anyway, where this
    program does not show itself as a node of ROS 2.

    Raises:
        ConfigError: the name is on none of several networks.
        TransportError: the network cannot be joined.

    Blocks: the first time, until it is joined.
    """
    settings = choose_network(node.config.ros2, name)
    there = name_there(settings, name_on_ros2(settings, name))
    transport = network_of(node, settings).transport if node.config.ros2 else node.transport

    def on_presence(presence: Presence) -> None:
        token = parse_token(presence.key)
        if token is not None:
            callback(presence.key, _endpoint(token, name), presence.alive)

    pattern = token_pattern(settings.domain, Kind.SERVICE, name=there)
    return transport.watch_alive(pattern, on_presence)


def list_any_type(node: Node, name: str) -> list[Endpoint]:
    """Return the services of a name on its configured ROS 2 network; otherwise as above."""
    settings = choose_network(node.config.ros2, name)
    there = name_there(settings, name_on_ros2(settings, name))
    tokens = network_of(node, settings).ros.list(kind=Kind.SERVICE, name=there)
    return [_endpoint(token, name) for token in tokens]


def _read(on_ros2: MessageOnRos2, payload: bytes) -> Any:
    """Return the message of this program for the bytes of one of ROS 2.

    Raises:
        DeserializationError: they are malformed, or this program's type cannot hold the values.
    """
    message = on_ros2.message.from_cdr(payload)
    try:
        return on_ros2.from_ros2(message)
    except FieldError as error:
        raise DeserializationError(message._type, len(payload), str(error)) from error
