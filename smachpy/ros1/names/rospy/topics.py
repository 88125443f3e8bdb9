"""Publishers and subscribers with rospy's arguments and exceptions.

Source:
    rospy.topics for names, arguments and exceptions.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.exceptions import TransportError, TypeMismatchError
from actionlib_core.node import get_node
from actionlib_core.pubsub.topic import Publisher as _Publisher
from actionlib_core.pubsub.topic import Subscriber as _Subscriber
from actionlib_core.wire.encoding import parse_encoding
from smachpy.ros1.names.rospy.core import is_initialized, logerr_once
from smachpy.ros1.names.rospy.exceptions import ROSException, as_rospy
from smachpy.ros1.names.rospy.msg import AnyMsg
from smachpy.ros1.names.rospy.names import Named
from smachpy.ros1.session import session
from smachpy.userdata.readonly import writable

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.transport import Sample

__all__ = ["Publisher", "SubscribeListener", "Subscriber", "Topic"]


class SubscribeListener:
    """Base class of listeners for a publisher's subscribers; here they are never called."""

    def peer_subscribe(self, topic_name: str, topic_publish: Any, peer_publish: Any) -> None:
        """Handle a new subscriber."""

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        """Handle the end of a subscriber."""


class Publisher(Named, _Publisher):
    """Publishes on a topic: an `actionlib_core.Publisher` with rospy's arguments."""

    def __init__(
        self,
        name: str,
        data_class: Any,
        subscriber_listener: SubscribeListener | None = None,
        tcp_nodelay: bool = False,
        latch: bool = False,
        headers: dict[str, str] | None = None,
        queue_size: int | None = None,
    ) -> None:
        del subscriber_listener, tcp_nodelay, headers
        if data_class is AnyMsg or not name:
            raise ValueError(f"Publisher {name!r}: got {data_class!r}; expected a message class.")
        with as_rospy():
            super().__init__(name, data_class, latch, queue_size)
        self.impl = self
        self._numbers = count(1)

    def publish(self, *args: Any, **kwds: Any) -> None:
        """Send a message, given or made from the arguments; its header gets the next `seq`.

        Raises:
            ROSException: `init_node` was not called, or the topic is closed.
            ROSSerializationException: a value does not fit its field.
        """
        if not is_initialized():
            raise ROSException(
                "ROS node has not been initialized yet. Please call init_node() first"
            )
        if session().dry:
            return
        try:
            with as_rospy():
                super().publish(self._numbered(args, kwds))
        except ROSException as error:
            # In rospy, publishing goes on when a subscriber has another type.
            if isinstance(error.__cause__, TypeMismatchError):
                logerr_once("%s", error)
            elif isinstance(error.__cause__, TransportError):
                raise ROSException("publish() to a closed topic") from error
            else:
                raise

    def _numbered(self, args: tuple[Any, ...], kwds: dict[str, Any]) -> Any:
        given = len(args) == 1 and not kwds and isinstance(args[0], self.data_class)
        message = args[0] if given else self.data_class(*args, **kwds)
        if self.data_class._has_header:
            message = writable(message)  # rospy numbers also messages that a state only reads
            message.header.seq = next(self._numbers)
        return message

    def get_num_connections(self) -> int:
        """Return the number of subscribers; 1 in a dry program, as some wait for the first."""
        return 1 if session().dry else super().get_num_connections()


class Subscriber(Named, _Subscriber[Any]):
    """Subscribes to a topic, with rospy's arguments; with `AnyMsg`, to messages of any type."""

    def __new__(cls, name: str, data_class: Any, *_args: Any, **_kwargs: Any) -> Any:
        """Make an instance; for `AnyMsg`, of a subclass."""
        del name
        return object.__new__(_AnySubscriber if data_class is AnyMsg else cls)

    def __init__(
        self,
        name: str,
        data_class: Any,
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        buff_size: int = 65536,
        tcp_nodelay: bool = False,
    ) -> None:
        del buff_size, tcp_nodelay
        with as_rospy():
            super().__init__(name, data_class, callback, callback_args, queue_size)
        self.impl = self


class _AnySubscriber(Subscriber):
    """Gets messages of any type as bytes."""

    def __init__(
        self,
        name: str,
        data_class: Any,
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        *_args: Any,
        **_kwargs: Any,
    ) -> None:
        node = get_node()
        self.node = node
        self._full_name = node.resolve(name, "topic name")
        self.type = "*"
        self.data_class = data_class
        self.callback = callback
        self.callback_args = callback_args
        self._closed = False
        self._calls = CallbackQueue(node, f"topic /{self._full_name}")
        self._parts = [node.transport.subscribe(self._full_name, self._on_sample)]
        self._forget = node.on_close(self.unregister)

    def get_num_connections(self) -> int:
        """Return 0: publishers of any type are not counted."""
        return 0

    def _on_sample(self, sample: Sample) -> None:
        self._calls.call(lambda: self._take(sample))

    def _take(self, sample: Sample) -> None:
        encoding = parse_encoding(sample.encoding)
        message = AnyMsg().deserialize(bytes(sample.payload))
        message._connection_header = {
            "type": encoding.type,
            "md5sum": encoding.md5,
            "topic": f"/{self._full_name}",
            "callerid": str(sample.source),
        }
        self._call_back(message)


def wait_for_any(topic: str, timeout: float | None) -> AnyMsg:
    """Return the next message of a topic, of any type.

    Raises:
        ROSException: none arrived in time, or the program is to end.
    """
    node = get_node()
    found: list[AnyMsg] = []
    came = node.clock.event(f"a message of {topic}")

    def keep(message: AnyMsg) -> None:
        found.append(message)
        came.set()

    subscriber = Subscriber(topic, AnyMsg, keep)
    try:
        came.wait(timeout)
    finally:
        subscriber.unregister()
    if not found:
        raise ROSException(f"timeout exceeded while waiting for message on topic {topic}")
    return found[0]


Topic = Publisher
