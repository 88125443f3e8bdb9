"""message_filters: synchronises messages of several topics.

Source:
    message_filters of ros_comm for names, arguments and meaning.

Threads: callbacks run in the thread of the subscriber whose message completes a set.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

from smachpy.ros1.names.rospy.core import logwarn
from smachpy.ros1.names.rospy.rostime import Time
from smachpy.ros1.names.rospy.topics import Subscriber as _Subscriber

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = [
    "ApproximateTimeSynchronizer",
    "Cache",
    "SimpleFilter",
    "Subscriber",
    "TimeSynchronizer",
]


class SimpleFilter:
    """Passes messages on to registered callbacks."""

    def __init__(self) -> None:
        self.callbacks: dict[int, tuple[Callable[..., object], tuple[Any, ...]]] = {}

    def registerCallback(self, cb: Callable[..., object], *args: Any) -> int:
        """Call `cb(message(s), *args)` from now on; return a number for the registration."""
        number = len(self.callbacks)
        self.callbacks[number] = cb, args
        return number

    def signalMessage(self, *msg: Any) -> None:
        """Pass messages on."""
        for callback, args in list(self.callbacks.values()):
            callback(*msg, *args)


class Subscriber(SimpleFilter):
    """A topic; arguments as `rospy.Subscriber`."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__()
        self.topic = args[0] if args else kwargs.get("name", "")
        kwargs["callback"] = self.signalMessage
        self.sub = _Subscriber(*args, **kwargs)

    def getTopic(self) -> str:
        """Return the topic's name."""
        return str(self.topic)

    def unregister(self) -> None:
        """Unsubscribe."""
        self.sub.unregister()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["sub"], name)


class Cache(SimpleFilter):
    """Keeps the newest messages of a filter.

    Args:
        f: The filter.
        cache_size: How many messages to keep.
        allow_headerless: Use the time of arrival for messages without a header.
    """

    def __init__(
        self, f: SimpleFilter | None = None, cache_size: int = 1, allow_headerless: bool = False
    ) -> None:
        super().__init__()
        self.cache_size = cache_size
        self._allow_headerless = allow_headerless
        self._kept: list[tuple[Any, Any]] = []
        if f is not None:
            self.connectInput(f)

    def connectInput(self, f: SimpleFilter) -> None:
        """Get the messages of `f`."""
        f.registerCallback(self.add)

    def add(self, msg: Any) -> None:
        """Handle a message."""
        stamp = _stamp(msg, self._allow_headerless)
        if stamp is None:
            logwarn("Cannot use message filters with messages of type %s", msg._type)
            return
        self._kept = [*self._kept, (stamp, msg)][-self.cache_size :]
        self.signalMessage(msg)

    def getInterval(self, from_stamp: Any, to_stamp: Any) -> list[Any]:
        """Return the messages between two times."""
        return [msg for stamp, msg in self._kept if from_stamp <= stamp <= to_stamp]

    def getElemAfterTime(self, stamp: Any) -> Any:
        """Return the oldest message at or after a time, or None."""
        return next((msg for other, msg in self._kept if other >= stamp), None)

    def getElemBeforeTime(self, stamp: Any) -> Any:
        """Return the newest message at or before a time, or None."""
        return next((msg for other, msg in reversed(self._kept) if other <= stamp), None)

    def getLastestTime(self) -> Any:
        """Return the time of the newest message, or None."""
        return self._kept[-1][0] if self._kept else None

    getLatestTime = getLastestTime  # noqa: N815  the original has both spellings

    def getOldestTime(self) -> Any:
        """Return the time of the oldest message, or None."""
        return self._kept[0][0] if self._kept else None

    def getLast(self) -> Any:
        """Return the newest message, or None."""
        return self._kept[-1][1] if self._kept else None


class TimeSynchronizer(SimpleFilter):
    """Passes on sets of messages with the same stamp, one message from each filter.

    Args:
        fs: The filters.
        queue_size: How many messages of each filter are kept until the others arrive.
    """

    def __init__(self, fs: Sequence[SimpleFilter], queue_size: int) -> None:
        super().__init__()
        self.queue_size = queue_size
        self.lock = threading.Lock()
        self._allow_headerless = False
        self._slop = 0.0
        self._queues: list[dict[Any, Any]] = [{} for _ in fs]
        for each, queue in zip(fs, self._queues, strict=True):
            each.registerCallback(self.add, queue)

    def add(self, msg: Any, my_queue: dict[Any, Any], my_queue_index: int | None = None) -> None:
        """Handle a message of one filter."""
        del my_queue_index
        stamp = _stamp(msg, self._allow_headerless)
        if stamp is None:
            logwarn("Cannot use message filters with messages of type %s", msg._type)
            return
        with self.lock:
            my_queue[stamp] = msg
            while len(my_queue) > self.queue_size:
                del my_queue[min(my_queue)]
            found = self._take_set(stamp, my_queue)
        if found:
            self.signalMessage(*found)

    def _take_set(self, stamp: Any, own: dict[Any, Any]) -> list[Any]:
        """Remove and return the messages nearest to a stamp, if they are near enough."""
        stamps = []
        for queue in self._queues:
            if not queue:
                return []
            nearest = min(queue, key=lambda other: abs((other - stamp).to_sec()))
            stamps.append(stamp if queue is own else nearest)
        if (max(stamps) - min(stamps)).to_sec() > self._slop:
            return []
        return [queue.pop(each) for queue, each in zip(self._queues, stamps, strict=True)]


class ApproximateTimeSynchronizer(TimeSynchronizer):
    """A `TimeSynchronizer` for stamps that differ by `slop` [s] at most.

    Args:
        fs: The filters.
        queue_size: How many messages of each filter are kept until the others arrive.
        slop: See above.
        allow_headerless: Use the time of arrival for messages without a header.
        reset: Ignored; time does not jump back here.
    """

    def __init__(
        self,
        fs: Sequence[SimpleFilter],
        queue_size: int,
        slop: float,
        allow_headerless: bool = False,
        reset: bool = False,
    ) -> None:
        del reset
        super().__init__(fs, queue_size)
        self._slop = float(slop)
        self._allow_headerless = allow_headerless


def _stamp(msg: Any, allow_headerless: bool) -> Any:
    header = getattr(msg, "header", None)
    if header is not None:
        return header.stamp
    return Time.now() if allow_headerless else None
