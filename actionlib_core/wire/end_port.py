"""One end of a topic or service, on the wire chosen by its type or the configuration of its name.

Publishers, subscribers, services and proxies use the network through an `EndPort`. Only the ports
know keys, encodings and tokens.
"""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from actionlib_core.exceptions import ConfigError
from actionlib_core.transport import Quality
from actionlib_core.transport.tokens import Endpoint, Kind, parse_token, token_key, token_pattern
from actionlib_core.wire.absence import explain_absence
from actionlib_core.wire.encoding import check_encoding, encoding_of, parse_encoding
from actionlib_core.wire.presence import list_endpoints

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from actionlib_core.node import Node
    from actionlib_core.transport import (
        Closable,
        Presence,
        Query,
        Reply,
        Sample,
        Transport,
    )

    OnEnd = Callable[[str, Endpoint, bool], None]

_OTHER_SIDE = {Kind.SUBSCRIBER: Kind.PUBLISHER, Kind.PUBLISHER: Kind.SUBSCRIBER}  # of a topic


class Sender(NamedTuple):
    """The sending end of a topic.

    Attributes:
        put: Sends a message; raises FieldError when a value does not fit its field, TransportError
            when the transport is closed. Blocks while a link is full.
        close: Ends the publication.
    """

    put: Callable[[Any], None]
    close: Callable[[], None]


class EndPort(Protocol):
    """One end of a topic or service; its methods raise TransportError when the session is closed.

    Attributes:
        own: The end, as others see it.
        ages: Whether its `age` tells which of two ends started first.
    """

    own: Endpoint
    ages: bool

    @property
    def transport(self) -> Transport:
        """The session that it uses."""

    def show(self) -> Closable:
        """Announce the end with a token."""

    def watch(self, kinds: Collection[Kind], callback: OnEnd) -> Closable:
        """Call back for each end of the name that is there, then at every change.

        The callback gets the end's unique key, the end, and whether it is there.
        """

    def list_services(self) -> list[Endpoint]:
        """Return the servers of the name. Blocks: until the network has answered, 1 s at most."""

    def explain_absence(self) -> str:
        """Return why there may be no other side: where it was looked for, and what is there.

        A service has a server at its other side, a subscriber a publisher, and the reverse.

        Blocks: as `list_services`.
        """

    def send(self, *, latch: bool) -> Sender:
        """Declare a publication."""

    def receive(self, callback: Callable[[Sample], None], *, latched: bool = True) -> Closable:
        """Subscribe, if wanted also to the latched message of each publisher."""

    def read(self, sample: Sample) -> Any:
        """Decode a message.

        Raises:
            TypeMismatchError: it is of another type.
            DeserializationError: its bytes are malformed.
        """

    def sender_of(self, sample: Sample) -> Endpoint:
        """Return the end that a message of another type came from."""

    def answer(self, callback: Callable[[Query], None]) -> Closable:
        """Answer requests."""

    def check(self, query: Query) -> None:
        """Check that a request can be answered.

        Raises:
            TypeMismatchError: it is of another type.
            ValueError: the query is not a request.
        """

    def read_request(self, query: Query) -> Any:
        """Decode a request; raises DeserializationError."""

    def reply(self, query: Query, response: Any) -> None:
        """Send a response; `query.finish` must follow."""

    def ask(
        self,
        request: Any,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        """Send a request; see `Transport.query`."""

    def read_response(self, reply: Reply) -> Any:
        """Decode a response; errors as `read`."""


def make_end_port(
    node: Node, kind: Kind, name: str, interface: Any, *, calls: bool = False
) -> EndPort:
    """Return a new end of the full name `name`, which is not yet announced.

    Args:
        node: Its node.
        kind: Its role; SERVICE also for a caller of services.
        calls: It is such a caller.
        name: See above.
        interface: Its message or service class; None for an end that only watches services, of any
            type.

    Raises:
        ConfigError: the interface is a ROS 2 type and the name is on no configured ROS 2 network;
            or the type has no counterpart on the network of the name.
        TransportError: that network cannot be joined.

    Blocks: the first time on a ROS 2 network, until it is joined.
    """
    if interface is None:
        return _AnyEndPort(node, kind, name, None)
    wire = getattr(interface, "_wire", "ros1")
    if wire == "ros2" or node.config.ros2:
        from actionlib_core.wire.ros2.mapping import find_network

        if find_network(node, name, interface) is not None:
            from actionlib_core.wire.ros2.end_port import RosEndPort

            return RosEndPort(node, kind, name, interface, calls=calls)
    return OwnEndPort(node, kind, name, interface)


class OwnEndPort:
    """An end on our own wire: ROS 1's bytes under the name itself; see `make_end_port`."""

    ages = True

    def __init__(self, node: Node, kind: Kind, name: str, interface: Any) -> None:
        self._node = node
        self._transport: Transport = node.transport
        self._interface = interface
        type_name, md5 = ("", "") if interface is None else (interface._type, interface._md5sum)
        self.own = node.endpoint(kind, name, type_name, md5)

    @property
    def transport(self) -> Transport:
        return self._transport

    def show(self) -> Closable:
        return self._transport.declare_alive(token_key(self.own))

    def watch(self, kinds: Collection[Kind], callback: OnEnd) -> Closable:
        def on_presence(presence: Presence) -> None:
            end = parse_token(presence.key)
            if end is not None and end.kind in kinds:
                callback(presence.key, end, presence.alive)

        kind = next(iter(kinds)) if len(kinds) == 1 else None
        return self._transport.watch_alive(token_pattern(kind, self.own.name), on_presence)

    def list_services(self) -> list[Endpoint]:
        return list_endpoints(self._transport, kind=Kind.SERVICE, name=self.own.name)

    def explain_absence(self) -> str:
        kind = _OTHER_SIDE.get(self.own.kind, Kind.SERVICE)
        return self._look_on_ros2() or explain_absence(self._node, self.own.name, kind)

    def _look_on_ros2(self) -> str:
        """Return that a ROS 2 robot has a service of the name; "" if none has."""
        if not self._node.config.ros2 or self.own.kind in _OTHER_SIDE:
            return ""
        from actionlib_core.wire.ros2.end_port import list_any_type

        with contextlib.suppress(ConfigError):  # the name is on none of several networks
            for other in list_any_type(self._node, self.own.name):
                return (
                    f"a ROS 2 robot has one, of type {other.type}, in node '/{other.node}'. Try "
                    f"'names: [{self.own.name}]' in the section ros2 of the configuration."
                )
        return ""

    def send(self, *, latch: bool) -> Sender:
        quality = Quality(express=True, latch=latch)
        encoding = encoding_of(self._interface)
        port = self._transport.publisher(self.own.name, encoding, quality)
        return Sender(lambda message: port.put(message.to_bytes()), port.close)

    def receive(self, callback: Callable[[Sample], None], *, latched: bool = True) -> Closable:
        return self._transport.subscribe(self.own.name, callback, history=latched)

    def read(self, sample: Sample) -> Any:
        check_encoding(sample.encoding, self._interface, name=self.own.name)
        return self._interface.from_bytes(sample.payload)

    def sender_of(self, sample: Sample) -> Endpoint:
        encoding = parse_encoding(sample.encoding)
        return Endpoint(
            Kind.PUBLISHER, sample.key, encoding.type, encoding.md5, sample.source, "", 0
        )

    def answer(self, callback: Callable[[Query], None]) -> Closable:
        return self._transport.queryable(self.own.name, callback)

    def check(self, query: Query) -> None:
        check_encoding(query.encoding, self._interface, name=self.own.name)

    def read_request(self, query: Query) -> Any:
        return self._interface._request_class.from_bytes(query.payload)

    def reply(self, query: Query, response: Any) -> None:
        query.reply(response.to_bytes(), encoding_of(self._interface))

    def ask(
        self,
        request: Any,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        return self._transport.query(
            self.own.name,
            request.to_bytes(),
            encoding=encoding_of(self._interface),
            timeout=timeout,
            on_reply=on_reply,
            on_done=on_done,
        )

    def read_response(self, reply: Reply) -> Any:
        check_encoding(reply.encoding, self._interface, name=self.own.name)
        return self._interface._response_class.from_bytes(reply.payload)


class _AnyEndPort(OwnEndPort):
    """An end that only watches the services of its name, of any type and on either wire."""

    def watch(self, kinds: Collection[Kind], callback: OnEnd) -> Closable:
        from actionlib_core.wire.ros2.end_port import watch_any_type

        watches = contextlib.ExitStack()
        with contextlib.suppress(ConfigError):  # on none of several networks of ROS 2
            watches.callback(watch_any_type(self._node, self.own.name, callback).close)
        watches.callback(super().watch(kinds, callback).close)
        return watches
