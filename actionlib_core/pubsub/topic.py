"""Topics: publishers and subscribers with rospy's interface.

Messages are dropped in one place only. A publisher blocks while a link is full; a subscriber keeps
the newest `queue_size` messages (default: 100,000) until its callback has run, and counts those
that it drops.

Source:
    rospy.Publisher, rospy.Subscriber and rospy.wait_for_message for names, arguments and meaning.
"""

from __future__ import annotations

import logging
import sys
import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

from actionlib_core import border
from actionlib_core.action._callbacks import CallbackQueue
from actionlib_core.exceptions import (
    ActionlibError,
    DeserializationError,
    NodeError,
    TypeMismatchError,
    WaitTimeoutError,
)
from actionlib_core.goal.bounded import MESSAGES, Backlog
from actionlib_core.inputs.arguments import (
    check_class,
    check_delay,
    check_function,
    check_queue_size,
)
from actionlib_core.pubsub._ends import NamedEnd, NameWatch, close_all
from actionlib_core.shutdown import requested
from actionlib_core.transport.tokens import Kind
from actionlib_core.wire.arrivals import Readable

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from actionlib_core.interfaces import Message
    from actionlib_core.node import Node
    from actionlib_core.time import Duration
    from actionlib_core.transport import Closable, Sample
    from actionlib_core.wire.end_port import Sender

M = TypeVar("M", bound="Message")
A = TypeVar("A")

logger = logging.getLogger("actionlib_core")


class _TopicEnd(NamedEnd):
    """Base class of publisher and subscriber."""

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
        """Let the end close with its node; return a function that undoes this."""
        return self.node.on_close(self.unregister)

    @property
    def name(self) -> str:
        """The topic as rospy prints it, with a slash in front."""
        return f"/{self._full_name}"

    def get_num_connections(self) -> int:
        """Return the number of ends of the other kind and of our type."""
        return len(self._ends.ends(self._counterpart))

    def wait_for_connections(self, count: int = 1, timeout: float | Duration | None = None) -> bool:
        """Wait until at least `count` ends of the other kind are there.

        Args:
            count: Their number.
            timeout: Longest wait [s]; None: until the node closes or shutdown is requested.

        Returns:
            Whether they are there.

        Raises:
            InvalidDurationError: `timeout` is not a duration.

        Blocks: see `timeout`.
        """
        limit = check_delay(f"topic {self.name}", "timeout", timeout)
        with self.telling():
            return self._ends.wait(lambda: self.get_num_connections() >= count, limit)

    def telling(self) -> AbstractContextManager[None]:
        """Return a block that waits for the other side: a log tells after 3 s that nobody is there.

        Use it only for waits that may be in vain, as most subscribers need no publisher.
        """
        return self._ends.telling(self._counterpart)

    def unregister(self) -> None:
        """Leave the topic; a second call does nothing.

        Messages that still wait are not delivered any more. A callback that is running, or just
        starting, in another thread is not waited for.
        """
        self._leave()

    def _join(self, declare: Callable[[], Closable]) -> None:
        """Declare our end and announce it; after an error, leave the topic."""
        try:
            self._parts.append(declare())
            self._parts.append(self._end.show())
        except BaseException:
            self.unregister()
            raise


class Publisher(_TopicEnd):
    """Sends messages of one class to a topic.

    A publisher that the program drops leaves the topic, unless it latches.

    Args:
        name: Topic name, relative, absolute or private.
        data_class: Class of the messages.
        latch: Keep the last message and send it to every later subscriber.
        queue_size: As in rospy, but without effect: nothing is queued here, `publish` blocks while
            a link is full.
        node: Its node; None: the current node.

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
        if self.latch:  # it must live on after the program has dropped it: for later subscribers
            return super()._leave_with_node()
        # The node and the finalizer must not refer to `self`, which would then never be dropped.
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

        Blocks: while a link is full.
        """
        if len(args) == 1 and not kwargs and isinstance(args[0], self.data_class):
            message = args[0]
        else:
            message = self.data_class(*args, **kwargs)
        if border.listeners:
            border.tell("published", self.node, self._full_name, self.type, "", message)
        self._sender.put(message)
        if self._ends.mismatches:
            self._raise_if_nobody_fits()

    def _raise_if_nobody_fits(self) -> None:
        others = set(self._ends.ends(self._counterpart, any_type=True))
        if others and not self.get_num_connections():
            raise self._ends.mismatches[0]


class NewsPublisher(Publisher):
    """A publisher whose program goes on if all subscribers have another type: that is only logged.

    For what a program tells of itself, to whoever listens: a stranger's mistake must not end it.
    """

    def _raise_if_nobody_fits(self) -> None:
        pass


class Subscriber(_TopicEnd, Generic[M]):
    """Calls back with every message of a topic, in order, one at a time.

    As in rospy it goes on when the program drops it, until `unregister` or the end of its node.

    Args:
        name: Topic name, relative, absolute or private.
        data_class: Class of the messages.
        callback: Called with the message, and with `callback_args` unless that is None.
        callback_args: Second argument of the callback.
        queue_size: Number of messages that may wait for the callback: beyond it the oldest is
            dropped and counted in `dropped`. None: 100,000 messages of together 32 MiB, and the
            first drop is logged.
        node: Its node; None: the current node.

    Raises:
        InvalidNameError: the name breaks the ROS rules.
        NodeError: the node is closed.

    A message whose bytes cannot be read is dropped; the first one is logged.

    Threads: the callback runs in a thread of the node's clock and may block. An exception is passed
        to `threading.excepthook`; the next message is delivered all the same.
    """

    _kind = Kind.SUBSCRIBER
    _counterpart = Kind.PUBLISHER
    _is_input = True
    _wants_latched = True
    _call: Callable[[Callable[[], None]], object]

    @overload
    def __init__(
        self,
        name: str,
        data_class: type[M],
        callback: Callable[[M], object] | None = None,
        callback_args: None = None,
        queue_size: int | None = None,
        *,
        node: Node | None = None,
    ) -> None: ...
    @overload
    def __init__(
        self,
        name: str,
        data_class: type[M],
        callback: Callable[[M, A], object],
        callback_args: A,
        queue_size: int | None = None,
        *,
        node: Node | None = None,
    ) -> None: ...
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
        self._lock = threading.Lock()  # guards `_waiting`
        # Whoever says how many messages wait gets so many, however large they are.
        self._waiting: Backlog[Sample] = (
            Backlog(queue_size, sys.maxsize) if queue_size else Backlog(MESSAGES)
        )
        self._readable = Readable(logger)
        self._number = next(border.numbers)
        if self._is_input and border.listeners:
            border.tell("subscriber", self.node, self._full_name, self.type, self._number)
        self._call = self._caller()
        # Last: a message may arrive at once, and needs all of the above.
        self._join(lambda: self._end.receive(self._on_sample, latched=self._wants_latched))

    def _caller(self) -> Callable[[Callable[[], None]], object]:
        return CallbackQueue(self.node, f"topic {self.name}").call

    @property
    def dropped(self) -> int:
        """Number of messages dropped because too many waited."""
        return self._waiting.dropped

    def _on_sample(self, sample: Sample) -> None:
        with self._lock:
            dropped_before = self._waiting.dropped
            fitted = self._waiting.add(sample, len(sample.payload))
        # One queued call per message. A message that has displaced another uses its call.
        if fitted:
            self._call(self._deliver)
        elif not dropped_before and not self.queue_size:  # with a queue_size, drops are intended
            logger.warning(
                "topic %s: messages arrive faster than they are processed: of %d waiting messages, "
                "the oldest is dropped. Try a faster callback, or a queue_size.",
                self.name,
                len(self._waiting),
            )

    def _deliver(self) -> None:
        with self._lock:
            sample = self._waiting.take()
        # None: one large message can displace several, and then there are more calls than messages.
        if sample is None or self._closed or self.callback is None:
            return
        try:
            message = self._end.read(sample)
        except TypeMismatchError as error:
            self._ends.note(error, self._end.sender_of(sample))
            return
        except DeserializationError as error:
            # Not an exception of the callback; and a sensor would send many of them in a second.
            text = f"topic {self.name}: a message cannot be read, and is dropped: {error}"
            self._readable.report("a message", ActionlibError(text))
            return
        self._call_back(message)

    def _call_back(self, message: M) -> None:
        if self._closed or self.callback is None:  # unregistered while the message was decoded
            return
        if self._is_input and border.listeners:
            border.tell("message", self.node, self._full_name, self.type, self._number, message)
        if self.callback_args is None:
            self.callback(message)
        else:
            self.callback(message, self.callback_args)


class WatchingSubscriber(Subscriber[M]):
    """A subscriber of somebody who only watches; what it gets is no input of the program."""

    _is_input = False


class FreshSubscriber(Subscriber[M]):
    """A subscriber that hears only what is published from now on, not what was latched before."""

    _wants_latched = False


class NotingSubscriber(Subscriber[M]):
    """A subscriber whose callback returns at once and so needs no thread of its own.

    Threads: the callback runs on the network's thread, which it must not block: it may store the
        message and set an event. The node and its clock are not the current ones there. Otherwise
        as `Subscriber`.
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
        timeout: Longest wait [s]; None: until the node closes or shutdown is requested.
        node: The subscriber's node; None: the current node.

    Raises:
        InvalidDurationError: `timeout` is not a duration.
        WaitTimeoutError: no message came in time.
        TypeMismatchError: all publishers of the topic have another type.
        NodeError: the node was closed, or shutdown was requested.

    Blocks: see `timeout`.
    """
    limit = check_delay(f"topic {topic!r}", "timeout", timeout)
    with _OneMessage(topic, topic_type, node) as subscriber:
        return subscriber.take(limit)


class _OneMessage(NotingSubscriber[M]):
    """The subscriber of `wait_for_message`."""

    def __init__(self, topic: str, topic_type: type[M], node: Node | None) -> None:
        self._found: list[M] = []
        super().__init__(topic, topic_type, self._keep, node=node)

    def _keep(self, message: M) -> None:
        self._found.append(message)
        self._ends.wake()

    def take(self, timeout: float | None) -> M:
        found = self._found
        with self.telling():
            self._ends.wait(lambda: bool(found) or self._mismatch() is not None, timeout)
        if found:
            return found[0]
        mismatch = self._mismatch()
        if mismatch is not None:
            raise mismatch
        if self._closed or self.node.closed or (timeout is None and requested()):
            raise NodeError(
                f"{self.name}: no message: the node was closed or shutdown was requested."
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
