"""What a faulty session declares: each part knows what a cut of the link does to it."""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.transport import Presence, Reply, Sample
from actionlib_core.transport._keys import key_matches

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Timer
    from actionlib_core.transport import Closable, PublisherPort, Query
    from actionlib_core.transport._faults import Fate
    from actionlib_core.transport.faulty import FaultyTransport


class Part:
    """Something declared, that hears of the link's end and return."""

    def __init__(self, transport: FaultyTransport) -> None:
        self._transport = transport
        self._handle: Closable | None = None

    def close(self) -> None:
        self._transport.remove(self)
        if self._handle is not None:
            self._handle.close()

    def on_dead(self) -> None:
        """The link has been cut for longer than the lease."""

    def on_restored(self) -> None:
        """The link is back."""


class Publisher:
    """The sending end of a key."""

    def __init__(self, transport: FaultyTransport, key: str, port: PublisherPort) -> None:
        self._transport = transport
        self._key = key
        self._port = port
        self._closed = False

    def put(self, payload: bytes) -> None:
        if self._closed:
            self._port.put(payload)  # raises what it raises
        for delay in self._transport.choose(self._key):
            if delay <= 0:
                self._port.put(payload)
            else:
                self._transport.later(delay, partial(self._put_late, payload))

    def _put_late(self, payload: bytes) -> None:
        if not self._closed:
            self._port.put(payload)

    def matching(self) -> bool:
        return self._port.matching() and not self._transport.is_dead

    def close(self) -> None:
        self._closed = True
        self._port.close()


class Subscriber(Part):
    """Hears nothing while the link is cut; after it, latched publishers are asked again."""

    def __init__(
        self,
        transport: FaultyTransport,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool,
    ) -> None:
        super().__init__(transport)
        self._key = key
        self._callback = callback
        self._history = history
        self._handle = transport.inner.subscribe(key, self._on_sample, history=history)
        transport.add(self)

    def _on_sample(self, sample: Sample) -> None:
        if not self._transport.is_cut:
            self._callback(sample)

    def on_restored(self) -> None:
        if self._history and self._handle is not None:
            self._handle.close()
            self._handle = self._transport.inner.subscribe(self._key, self._on_sample)


class Queryable(Part):
    """Is not reached while the link is cut."""

    def __init__(
        self, transport: FaultyTransport, key: str, callback: Callable[[Query], None]
    ) -> None:
        super().__init__(transport)
        self._callback = callback
        self._unheard: list[Query] = []
        self._handle = transport.inner.queryable(key, self._on_query)
        transport.add(self)

    def _on_query(self, query: Query) -> None:
        if self._transport.is_cut:
            self._unheard.append(query)
        else:
            self._callback(CuttableQuery(self._transport, query))

    def on_dead(self) -> None:
        self.on_restored()

    def on_restored(self) -> None:
        unheard, self._unheard = self._unheard, []
        for query in unheard:
            query.finish()


class CuttableQuery(Part):
    """A query whose answer is lost while the link is cut."""

    def __init__(self, transport: FaultyTransport, query: Query) -> None:
        super().__init__(transport)
        self._query = query
        self._finished = False
        self.key = query.key
        self.payload = query.payload
        self.encoding = query.encoding
        transport.add(self)

    def reply(self, payload: bytes, encoding: str = "") -> None:
        if not self._transport.is_cut:
            self._query.reply(payload, encoding)

    def reply_error(self, text: str) -> None:
        if not self._transport.is_cut:
            self._query.reply_error(text)

    def finish(self) -> None:
        self._finished = True
        if not self._transport.is_cut:
            self._end()

    def on_dead(self) -> None:
        self._end()

    def on_restored(self) -> None:
        if self._finished:
            self._end()

    def _end(self) -> None:
        self._transport.remove(self)
        self._query.finish()


class Asking(Part):
    """A query of this session: lost, late, or under way."""

    def __init__(
        self,
        transport: FaultyTransport,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> None:
        super().__init__(transport)
        self._on_reply = on_reply
        self._on_done = on_done
        self._over = threading.Lock()  # held once it is over
        self._timer: Timer | None = None
        transport.add(self)

    def start(self, ask: Callable[[], Closable], fate: Fate, timeout: float) -> None:
        if fate and fate[0] <= 0:
            self._handle = ask()
            return
        self._timer = self._transport.clock.call_later(timeout, self.finish)
        if fate:
            self._transport.later(fate[0], partial(self._start_late, ask))

    def _start_late(self, ask: Callable[[], Closable]) -> None:
        if not self._over.locked():
            self._handle = ask()

    def take_reply(self, reply: Reply) -> None:
        if not (self._over.locked() or self._transport.is_cut):
            self._on_reply(reply)

    def finish(self) -> None:
        if self._over.acquire(blocking=False):
            self._leave()
            self._on_done()

    def on_dead(self) -> None:
        self.finish()

    def close(self) -> None:
        if self._over.acquire(blocking=False):
            self._leave()

    def _leave(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        super().close()


class Token(Part):
    """A token that the others lose sight of when the link is dead."""

    def __init__(self, transport: FaultyTransport, key: str) -> None:
        super().__init__(transport)
        self.key = key
        if not transport.is_cut:
            self._handle = transport.inner.declare_alive(key)
        transport.add(self)

    def on_dead(self) -> None:
        if self._handle is not None:
            self._handle.close()
            self._handle = None

    def on_restored(self) -> None:
        if self._handle is None:
            self._handle = self._transport.inner.declare_alive(self.key)


class Watcher(Part):
    """Shows what this session can know of the tokens."""

    def __init__(
        self, transport: FaultyTransport, pattern: str, callback: Callable[[Presence], None]
    ) -> None:
        super().__init__(transport)
        self._pattern = pattern
        self._callback = callback
        self._there: set[str] = set()
        self._shown: set[str] = set()
        self._handle = transport.inner.watch_alive(pattern, self._on_presence)
        transport.add(self)

    def _on_presence(self, presence: Presence) -> None:
        (self._there.add if presence.alive else self._there.discard)(presence.key)
        if not self._transport.is_cut:
            self._show(self._there)

    def on_dead(self) -> None:
        self._show(set())

    def on_restored(self) -> None:
        self._transport.later(0.0, self._show_all)

    def _show_all(self) -> None:
        self._show(self._there)

    def _show(self, others: set[str]) -> None:
        """Tell of the difference to what was told so far; own tokens are always seen."""
        own = self._transport.own_tokens()
        wanted = others | {key for key in own if key_matches(self._pattern, key)}
        gone, new = sorted(self._shown - wanted), sorted(wanted - self._shown)
        self._shown = wanted
        for key in gone:
            self._callback(Presence(key, alive=False))
        for key in new:
            self._callback(Presence(key, alive=True))
