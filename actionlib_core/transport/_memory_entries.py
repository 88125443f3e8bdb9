"""The declarations of a session in memory, and the inbox that delivers to their callbacks.

An entry adds itself to the network's tables when it is made and removes itself when it is closed.
Both need the network's lock, and so does every method whose name ends in `_locked`.
"""

from __future__ import annotations

import threading
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.exceptions import TransportError
from actionlib_core.transport import Presence, Quality, Reply, Sample
from actionlib_core.transport._keys import compile_pattern

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock, Event
    from actionlib_core.transport.memory import MemoryTransport

T = TypeVar("T")
E = TypeVar("E", bound="Entry")

CLOSE_WAIT_S = 0.9  # how long `close` waits for a callback that is running in another thread


class Inbox:
    """The items that wait for one session, first in, first out, with their receivers."""

    __slots__ = ("_clock", "_idle", "_items", "_running", "_shut")

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._items: deque[tuple[Receiver, Any]] = deque()
        self._running: int | None = None  # id of the thread that delivers
        self._idle: Event | None = None
        self._shut = False

    def post(self, receiver: Receiver, item: object) -> None:
        self._items.append((receiver, item))
        self._clock.call_later(0.0, self._deliver)

    # No lock is needed: `_deliver` sets `_running` before it reads `_shut`, and `shut` sets `_shut`
    # before it reads `_running`. So one of the two sees the other.
    def _deliver(self) -> None:
        receiver, item = self._items.popleft()
        self._running = threading.get_ident()
        try:
            if not self._shut:
                receiver.deliver(item)
        except Exception:  # noqa: BLE001  reported here, so that the next item is delivered
            report_thread_exception()
        finally:
            self._running = None
            if self._idle is not None:
                self._idle.set()

    def shut(self, *, wait: bool) -> None:
        """Deliver nothing more.

        Blocks: if `wait`, until a callback running in another thread has returned, `CLOSE_WAIT_S`
            at most.
        """
        if wait:
            self._idle = self._clock.event()
        self._shut = True
        if self._idle is not None and self._running not in {None, threading.get_ident()}:
            self._idle.wait(CLOSE_WAIT_S)


class Receiver(Protocol):
    """Receives the items of an inbox."""

    def deliver(self, item: Any) -> None:
        """Handle an item, unless closed."""


class Entry:
    """A declaration of a session, which is in the network's tables until it is closed."""

    __slots__ = ("closed", "network", "session")

    def __init__(self, session: MemoryTransport) -> None:
        self.session = session
        self.network = session.network
        self.closed = False

    def close(self) -> None:
        with self.network.lock:
            self.close_locked()

    def close_locked(self) -> None:
        if not self.closed:
            self.closed = True
            self.session.declared.pop(self, None)
            self.withdraw_locked()

    def withdraw_locked(self) -> None:
        """Leave the network's tables."""
        raise NotImplementedError

    def link_dead_locked(self) -> None:
        """React to a link that was cut for longer than its lease (`FaultyTransport`)."""

    def link_back_locked(self) -> None:
        """React to the return of the session's link."""


class Listener(Entry, Generic[T]):
    """A callback of a session."""

    __slots__ = ("_callback", "inbox")

    def __init__(self, session: MemoryTransport, callback: Callable[[T], None]) -> None:
        super().__init__(session)
        self._callback = callback
        self.inbox = session.inbox

    def deliver(self, item: T) -> None:
        if not self.closed:
            self._callback(item)


class Subscriber(Listener[Sample]):
    """Receives the messages of a key."""

    __slots__ = ("_cached", "_history", "_key")

    def __init__(
        self,
        session: MemoryTransport,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool,
        cached: int = 0,
    ) -> None:
        super().__init__(session, callback)
        self._key = key
        self._cached = cached
        self._history = history and not cached
        _add(self.network.subscribers, key, self)
        self.link_back_locked()

    def link_back_locked(self) -> None:
        for publisher in self.network.latches.get(self._key, ()):
            self.take_kept_locked(publisher)

    def take_kept_locked(self, publisher: Publisher) -> None:
        """Take the last messages of a publisher."""
        wanted = self._cached if publisher.has_cache else int(self._history)
        for sample in list(publisher.kept)[-wanted:] if wanted else ():
            self.inbox.post(self, sample)

    def deliver(self, item: Sample) -> None:
        # A message that was on its way when the link was cut is lost too.
        link = self.session.link
        if not (self.closed or (link is not None and link.is_cut)):
            self._callback(item)

    def withdraw_locked(self) -> None:
        _remove(self.network.subscribers, self._key, self)


class Queryable(Listener["MemoryQuery"]):
    """Receives the queries on a key; those that it can no longer answer are finished."""

    __slots__ = ("_key", "complete")

    def __init__(
        self,
        session: MemoryTransport,
        key: str,
        callback: Callable[[MemoryQuery], None],
        *,
        complete: bool = False,
    ) -> None:
        super().__init__(session, callback)
        self._key = key
        self.complete = complete
        _add(self.network.queryables, key, self)

    def deliver(self, item: MemoryQuery) -> None:
        if self.closed or self.session.is_cut:
            item.finish()
            return
        try:
            self._callback(item)
        except Exception as error:
            item.reply_error(f"{type(error).__name__}: {error}")
            item.finish()
            raise

    def withdraw_locked(self) -> None:
        _remove(self.network.queryables, self._key, self)


class Watcher(Listener[Presence | None]):
    """Watches tokens; behind a faulty link, those that are visible through it.

    `_there` are the tokens of the network, `_shown` those that the callback knows of.
    """

    __slots__ = ("_shown", "_there", "pattern")

    def __init__(
        self, session: MemoryTransport, pattern: str, callback: Callable[[Presence], None]
    ) -> None:
        super().__init__(session, callback)  # type: ignore[arg-type]  # None stays here
        self.pattern = compile_pattern(pattern)
        self._there: set[str] = set()
        self._shown: set[str] = set()
        self.network.watchers.append(self)
        for key in self.network.match_tokens(self.pattern):
            self.inbox.post(self, Presence(key, alive=True))

    def deliver(self, item: Presence | None) -> None:
        link = self.session.link
        if link is None:
            super().deliver(item)
            return
        if item is not None:
            (self._there.add if item.alive else self._there.discard)(item.key)
        if link.is_cut and not link.is_dead:  # within the lease, nothing changes for this session
            return
        with self.network.lock:
            seen = set(self.session.own_tokens(self.pattern))  # visible without a link
        seen |= set() if link.is_dead else self._there
        gone, new = sorted(self._shown - seen), sorted(seen - self._shown)
        self._shown = seen
        for key in gone:
            super().deliver(Presence(key, alive=False))
        for key in new:
            super().deliver(Presence(key, alive=True))

    def link_dead_locked(self) -> None:
        self.inbox.post(self, None)

    def link_back_locked(self) -> None:
        self.inbox.post(self, None)

    def withdraw_locked(self) -> None:
        self.network.watchers.remove(self)


class Token(Entry):
    """A liveliness token, which vanishes for other sessions while the link is dead."""

    __slots__ = ("_shown", "key")

    def __init__(self, session: MemoryTransport, key: str) -> None:
        super().__init__(session)
        self.key = key
        self._shown = False
        if not session.is_cut:
            self.link_back_locked()

    def link_back_locked(self) -> None:
        if not self._shown:
            self._shown = True
            self.network.count_token(self.key, 1)

    def link_dead_locked(self) -> None:
        if self._shown:
            self._shown = False
            self.network.count_token(self.key, -1)

    def withdraw_locked(self) -> None:
        self.link_dead_locked()


class Publisher(Entry):
    """The sending end of a key."""

    __slots__ = ("_encoding", "_key", "_latch", "_source", "has_cache", "kept")

    def __init__(
        self,
        session: MemoryTransport,
        key: str,
        encoding: str,
        quality: Quality,
        kept: bytes | None = None,
    ) -> None:
        super().__init__(session)
        self._key = key
        self._encoding = encoding
        self._latch = quality.latch or quality.cache > 0
        self._source = session.session_id
        self.has_cache = quality.cache > 0
        self.kept: deque[Sample] = deque(maxlen=quality.cache or 1)
        if self._latch:
            _add(self.network.latches, key, self)
        if kept is not None:
            self.kept.append(Sample(key, kept, encoding, self._source))
            for subscriber in self.network.subscribers.get(key, ()):
                subscriber.take_kept_locked(self)

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        link = self.session.link
        if link is None or self.closed:
            self._put(payload, attachment)
            return
        for delay in link.choose(self._key):
            if delay <= 0:
                self._put(payload, attachment)
            else:
                link.later(delay, partial(self._put_late, payload, attachment))

    def _put_late(self, payload: bytes, attachment: bytes | None) -> None:
        # What was sent arrives, also if the publisher has been closed meanwhile.
        with self.network.lock:
            if self.session.is_open:
                self._deliver_locked(payload, attachment)

    def _put(self, payload: bytes, attachment: bytes | None) -> None:
        with self.network.lock:
            if self.closed:
                if self.session.killed:  # see `MemoryTransport.kill`
                    return
                raise TransportError(
                    f"{self._key}: the publisher is closed. Try sending before the node is closed."
                )
            self._deliver_locked(payload, attachment)

    def _deliver_locked(self, payload: bytes, attachment: bytes | None) -> None:
        network = self.network
        subscribers = network.subscribers.get(self._key, ())
        if not (subscribers or self._latch):
            return
        stamp_ns = 0 if attachment is None else network.clock.time_ns()
        sample = Sample(self._key, payload, self._encoding, self._source, attachment, stamp_ns)
        if self._latch:
            self.kept.append(sample)
        for subscriber in subscribers:
            subscriber.inbox.post(subscriber, sample)

    def matching(self) -> bool:
        link = self.session.link
        return self._key in self.network.subscribers and not (link is not None and link.is_dead)

    def withdraw_locked(self) -> None:
        if self._latch:
            _remove(self.network.latches, self._key, self)


class Exchange(Entry):
    """One running query: it counts the queryables that have not finished their answers."""

    __slots__ = ("_on_done", "_on_reply", "_timer", "_waiting")

    def __init__(
        self,
        session: MemoryTransport,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> None:
        super().__init__(session)
        self._on_reply = on_reply
        self._on_done = on_done
        self._waiting = 1  # 1 until the query is sent, plus 1 per queryable that has not finished
        self._timer = self.network.clock.call_later(timeout, self._time_out)

    def ask(
        self, key: str, payload: bytes, encoding: str, attachment: bytes | None, *, best: bool
    ) -> None:
        """Send the query to all queryables or the best of them, unless it has timed out."""
        with self.network.lock:
            if not self._waiting:
                return
            asked = self.network.queryables.get(key, [])
            if best:
                asked = [queryable for queryable in asked if queryable.complete][:1] or asked
            for queryable in asked:
                self._waiting += 1
                query = MemoryQuery(self, queryable.session, key, payload, encoding, attachment)
                queryable.inbox.post(queryable, query)
            self.finish_locked()

    def _time_out(self) -> None:
        with self.network.lock:
            self.link_dead_locked()

    def link_dead_locked(self) -> None:
        if self._waiting:
            self._waiting = 0
            self._end()

    def reply_locked(self, reply: Reply) -> None:
        if self._waiting:
            self.session.inbox.post(self, partial(self._take_reply, reply))

    def _take_reply(self, reply: Reply) -> None:
        if not self.session.is_cut:
            self._on_reply(reply)

    def finish_locked(self) -> None:
        if self._waiting:
            self._waiting -= 1
            if not self._waiting:
                self._end()

    def _end(self) -> None:
        self._timer.cancel()
        self.session.inbox.post(self, self._finish)

    def _finish(self) -> None:
        self.close()
        self._on_done()

    def deliver(self, item: Callable[[], object]) -> None:
        if not self.closed:
            item()

    def withdraw_locked(self) -> None:
        self._waiting = 0
        self._timer.cancel()


class MemoryQuery(Entry):
    """A query as one queryable sees it."""

    __slots__ = ("_exchange", "_finished", "attachment", "encoding", "key", "payload")

    def __init__(
        self,
        exchange: Exchange,
        session: MemoryTransport,
        key: str,
        payload: bytes,
        encoding: str,
        attachment: bytes | None,
    ) -> None:
        super().__init__(session)
        self._exchange = exchange
        self._finished = False
        self.key = key
        self.payload = payload
        self.encoding = encoding
        self.attachment = attachment
        session.declared[self] = None

    def reply(self, payload: bytes, encoding: str = "", *, attachment: bytes | None = None) -> None:
        source = self.session.session_id
        self._reply(Reply(self.key, payload, encoding, False, attachment, source))  # noqa: FBT003

    def reply_error(self, text: str) -> None:
        source = self.session.session_id
        self._reply(Reply("", text.encode(), "", error=True, source=source))

    def _reply(self, reply: Reply) -> None:
        with self.network.lock:
            if not (self.closed or self.session.is_cut):
                self._exchange.reply_locked(reply)

    def finish(self) -> None:
        with self.network.lock:
            # While the link is cut, the end of the answer is not sent: `link_back_locked`, or
            # `link_dead_locked` after the lease, closes this later.
            self._finished = True
            link = self.session.link
            if link is None or not link.is_cut or link.is_dead:
                self.close_locked()

    def link_dead_locked(self) -> None:
        self.close_locked()

    def link_back_locked(self) -> None:
        if self._finished:
            self.close_locked()

    def withdraw_locked(self) -> None:
        self._exchange.finish_locked()


def _add(table: dict[str, list[E]], key: str, entry: E) -> None:
    table.setdefault(key, []).append(entry)


def _remove(table: dict[str, list[E]], key: str, entry: E) -> None:
    entries = table[key]
    entries.remove(entry)
    if not entries:
        del table[key]
