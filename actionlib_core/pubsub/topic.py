"""Topics: publish messages to whoever subscribes, in rospy's shape.

Nothing is dropped on the way unless it is said here: a publisher waits when the network has no
room, a subscriber keeps the newest `queue_size` messages (100,000 if nothing is said) until its
callback has run, and counts what it dropped.

Source:
    rospy.Publisher, rospy.Subscriber and rospy.wait_for_message for names, arguments and meaning.
"""

from __future__ import annotations

import logging
import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from actionlib_core._arguments import check_class, check_delay, check_function, check_queue_size
from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.exceptions import NodeError, TypeMismatchError, WaitTimeoutError
from actionlib_core.goal.bounded import MESSAGES, Backlog
from actionlib_core.pubsub._ends import End, NameWatch, close_all
from actionlib_core.shutdown import requested
from actionlib_core.wire.presence import Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.wire.end_port import Sender

M = TypeVar("M", bound="Message")

logger = logging.getLogger("actionlib_core")


class _TopicEnd(End):
    """What publisher and subscriber share."""

    _what = "topic"
    _counterpart: Kind

    def __init__(self, name: str, data_class: type[Message], node: Node | None) -> None:
        check_class(f"topic {name!r}", data_class, "from_bytes", "message class, such as String")
        super().__init__(name, data_class, node)
        self.data_class = data_class
        self._ends = NameWatch(self.node, self._end, {Kind.PUBLISHER, Kind.SUBSCRIBER})
        self._parts.append(self._ends)
        self._forget = self._leave_with_node()

    def _leave_with_node(self) -> Callable[[], None]:
        """See to it that the end closes with its node; returns how to forget that."""
        return self.node.on_close(self.unregister)

    @property
    def name(self) -> str:
        """The topic as rospy prints it, with a slash in front."""
        return f"/{self.resolved_name}"

    def get_num_connections(self) -> int:
        """Return how many ends of the other kind, of our type, there are."""
        return len(self._ends.ends(self._counterpart))

    def wait_for_connections(self, count: int = 1, timeout: float | Duration | None = None) -> bool:
        """Wait until at least `count` ends of the other kind are there.

        Args:
            count: How many.
            timeout: Longest wait [s]; None waits until the node closes or the program is to end.

        Returns:
            Whether they are.

        Raises:
            InvalidDurationError: `timeout` is no time.

        Blocks: see `timeout`.
        """
        limit = check_delay(f"topic {self.name}", "timeout", timeout)
        return self._ends.wait(lambda: self.get_num_connections() >= count, limit)

    def unregister(self) -> None:
        """Leave the topic; a second call does nothing.

        What has not reached a callback yet never does. One that runs in another thread then, or is
        just being entered there, is not waited for.
        """
        self._leave()

    def _join(self, declare: Callable[[], Closable]) -> None:
        """Declare our end and show it; all of it, or nothing and the error."""
        try:
            self._parts.append(declare())
            self._parts.append(self._end.show())
        except BaseException:
            self.unregister()
            raise


class Publisher(_TopicEnd):
    """Sends messages of one class to a topic.

    One that the program drops leaves the topic, unless it latches.

    Args:
        name: Topic name, relative, absolute or private.
        data_class: Class of the messages.
        latch: Keep the last message and give it to every subscriber that comes later.
        queue_size: As rospy takes it; nothing is queued here: `publish` hands the message to the
            network and waits while that has no room.
        node: Where it lives; the node in force when None.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.

    Threads: every method may be called from any thread; a callback may publish.
    """

    _kind = Kind.PUBLISHER
    _counterpart = Kind.SUBSCRIBER

    def __init__(
        self,
        name: str,
        data_class: type[Message],
        latch: bool = False,
        queue_size: int | None = None,
        *,
        node: Node | None = None,
    ) -> None:
        check_queue_size(f"topic {name!r}", queue_size)
        self.queue_size = queue_size
        self.latch = latch
        super().__init__(name, data_class, node)
        self._sender: Sender
        self._join(self._declare)

    def _leave_with_node(self) -> Callable[[], None]:
        if self.latch:  # its last message is for those who come later
            return super()._leave_with_node()
        leave = partial(close_all, self._parts)
        forget = self.node.on_close(leave)
        let_go = weakref.finalize(self, self.node.let_go, lambda: (forget(), leave()))
        let_go.atexit = False

        def leave_now() -> None:
            let_go.detach()
            forget()

        return leave_now

    def _declare(self) -> Sender:
        self._sender = self._end.send(latch=self.latch)
        return self._sender

    def publish(self, *args: Any, **kwargs: Any) -> None:
        """Send a message, or one made from the arguments: `publish("hello")`, `publish(data=1)`.

        Raises:
            FieldError: a value does not fit its field.
            TypeMismatchError: there are subscribers, but all of them have another type.
            TransportError: the publisher or its node is closed.

        Blocks: while the network has no room.
        """
        if len(args) == 1 and not kwargs and isinstance(args[0], self.data_class):
            message = args[0]
        else:
            message = self.data_class(*args, **kwargs)
        self._sender.put(message)
        if self._ends.mismatches:
            self._raise_if_nobody_fits()

    def _raise_if_nobody_fits(self) -> None:
        others = set(self._ends.ends(self._counterpart, any_type=True))
        if others and not self.get_num_connections():
            raise self._ends.mismatches[0]


class Subscriber(_TopicEnd, Generic[M]):
    """Calls back with every message of a topic, in order, one at a time.

    It goes on when the program drops it, as in rospy, until `unregister` or the end of its node.

    Args:
        name: Topic name, relative, absolute or private.
        data_class: Class of the messages.
        callback: Gets the message, and `callback_args` when these are given.
        callback_args: Second argument of the callback; None is none.
        queue_size: How many messages may wait for the callback: when there are more, the oldest is
            dropped and counted in `dropped`. None is 100,000, of 32 MiB together, and a drop is
            logged, once.
        node: Where it lives; the node in force when None.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.

    Threads: the callback runs in a thread of the node's clock and may block; an exception is given
        to `threading.excepthook`, and the next message comes.
    """

    _kind = Kind.SUBSCRIBER
    _counterpart = Kind.PUBLISHER
    _call: Callable[[Callable[[], None]], object]

    def __init__(
        self,
        name: str,
        data_class: type[M],
        callback: Callable[..., object] | None = None,
        callback_args: Any = None,
        queue_size: int | None = None,
        *,
        node: Node | None = None,
    ) -> None:
        check_function(f"topic {name!r}", "callback", callback)
        check_queue_size(f"topic {name!r}", queue_size)
        super().__init__(name, data_class, node)
        self.callback = callback
        self.callback_args = callback_args
        self.queue_size = queue_size
        self._lock = threading.Lock()  # guards the messages that wait
        self._waiting: Backlog[Sample] = Backlog(queue_size or MESSAGES)
        self._call = self._caller()
        self._join(lambda: self._end.receive(self._on_sample))

    def _caller(self) -> Callable[[Callable[[], None]], object]:
        return CallbackQueue(self.node, f"topic {self.name}").call

    @property
    def dropped(self) -> int:
        """How many messages were dropped because too many waited."""
        return self._waiting.dropped

    def _on_sample(self, sample: Sample) -> None:
        with self._lock:
            dropped_before = self._waiting.dropped
            fitted = self._waiting.add(sample, len(sample.payload))
        if fitted:  # one call each; a message that pushed another out is delivered in its place
            self._call(self._deliver)
        elif not dropped_before and not self.queue_size:  # else it was asked for
            logger.warning(
                "topic %s: messages come faster than they are taken, and the oldest of %d is "
                "dropped. Try a callback that takes no time, or a queue_size.",
                self.name,
                len(self._waiting),
            )

    def _deliver(self) -> None:
        with self._lock:
            sample = self._waiting.take()
        if sample is None or self._closed or self.callback is None:  # None: a drop was its end
            return
        try:
            message = self._end.read(sample)
        except TypeMismatchError as error:
            self._ends.note(error, self._end.sender_of(sample))
            return
        self._call_back(message)

    def _call_back(self, message: M) -> None:
        if self._closed or self.callback is None:  # it may have left while the message was read
            return
        if self.callback_args is None:
            self.callback(message)
        else:
            self.callback(message, self.callback_args)


class NotingSubscriber(Subscriber[M]):
    """A subscriber whose callback only takes note of the message: no thread is needed for that.

    Threads: the callback runs on the network's thread, which it must not hold up: it may keep the
        message and set an event, and knows no clock and node of its own. The rest as above.
    """

    def _caller(self) -> Callable[[Callable[[], None]], object]:
        return lambda deliver: deliver()


def wait_for_message(
    topic: str,
    topic_type: type[M],
    timeout: float | Duration | None = None,
    *,
    node: Node | None = None,
) -> M:
    """Return the next message of a topic, or its latched one.

    Args:
        topic: Topic name, relative, absolute or private.
        topic_type: Class of the message.
        timeout: Longest wait [s]; None waits until the node closes or the program is to end.
        node: Where to listen; the node in force when None.

    Raises:
        InvalidDurationError: `timeout` is no time.
        WaitTimeoutError: no message came in time.
        TypeMismatchError: somebody publishes another type there, and nobody ours.
        NodeError: the node was closed, or the program is to end.

    Blocks: see `timeout`.
    """
    limit = check_delay(f"topic {topic!r}", "timeout", timeout)
    with _OneMessage(topic, topic_type, node) as subscriber:
        return subscriber.take(limit)


class _OneMessage(NotingSubscriber[M]):
    """A subscriber that is waited for."""

    def __init__(self, topic: str, topic_type: type[M], node: Node | None) -> None:
        self._found: list[M] = []
        super().__init__(topic, topic_type, self._keep, node=node)

    def _keep(self, message: M) -> None:
        self._found.append(message)
        self._ends.wake()

    def take(self, timeout: float | None) -> M:
        found = self._found
        self._ends.wait(lambda: bool(found) or self._mismatch() is not None, timeout)
        if found:
            return found[0]
        mismatch = self._mismatch()
        if mismatch is not None:
            raise mismatch
        if self._closed or self.node.closed or (timeout is None and requested()):
            raise NodeError(
                f"{self.name}: no message: the node was closed or the program is to end."
            )
        raise WaitTimeoutError(
            f"{self.name}: no message: got none in {timeout:g} s, "
            f"{self.get_num_connections()} publishers there; expected a {self.type}. "
            f"Try 'actionlib topic info {self.name}'."
        )

    def _mismatch(self) -> TypeMismatchError | None:
        if self.get_num_connections() or not self.mismatches:
            return None
        return self.mismatches[0]
