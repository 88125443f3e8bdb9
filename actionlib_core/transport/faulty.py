# ruff: noqa: D102  the methods of a session are documented in the protocol
"""A bad network on purpose: drops, delays, repeats, reorders, and cuts of the link.

Wrap one end's session, or both, to see what a protocol makes of it. Everything is deterministic: a
plan decides the fate of the n-th message of a key, the clock delivers what is late.
"""

from __future__ import annotations

import threading
from collections import Counter
from functools import partial
from typing import TYPE_CHECKING

from actionlib_core.clock import current_clock
from actionlib_core.transport import Presence, Quality, Reply, Sample
from actionlib_core.transport._faults import (
    DELIVERED,
    DROPPED,
    RandomFaults,
    ScriptedFaults,
    Sent,
    deliver_all,
)
from actionlib_core.transport._faulty_parts import (
    Asking,
    Part,
    Publisher,
    Queryable,
    Subscriber,
    Token,
    Watcher,
)
from actionlib_core.transport._keys import key_matches

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.transport import Closable, PublisherPort, Query, Transport
    from actionlib_core.transport._faults import Fate, Plan

__all__ = [
    "DELIVERED",
    "DROPPED",
    "FaultyTransport",
    "RandomFaults",
    "ScriptedFaults",
    "Sent",
    "deliver_all",
]

DEFAULT_QUALITY = Quality()


class FaultyTransport:
    """A session whose messages suffer the fates of a plan and whose link can be cut.

    While the link is cut nothing gets out or in, what is sent is lost, and queries stay unanswered.
    When the cut lasts longer than the lease, the other sessions see the tokens of this one vanish,
    and it sees theirs vanish; all that are there appear again when the link is back, and latched
    messages come once more.

    Args:
        inner: The session that does the work; closing this closes it.
        plan: Decides the fate of what this session sends: messages, and queries too, of which only
            one copy is ever sent.
        clock: Delivers what is late; the current clock when None.
        lease: How long [s] a cut link counts as alive.

    Threads: as the protocol says; `cut` and `restore` from any thread.
    """

    def __init__(
        self,
        inner: Transport,
        plan: Plan = deliver_all,
        *,
        clock: Clock | None = None,
        lease: float = 10.0,
    ) -> None:
        self.inner = inner
        self.clock = current_clock() if clock is None else clock
        self.plan = plan
        self.lease = lease
        self.sent: list[Sent] = []
        self.is_cut = False
        self.is_dead = False
        self._lock = threading.Lock()
        self._counts: Counter[str] = Counter()
        self._timers: list[Timer] = []
        self._parts: dict[Part, None] = {}
        self._closed = False

    @property
    def session_id(self) -> str:
        """The inner session's id."""
        return self.inner.session_id

    # -- faults --------------------------------------------------------------------------------

    def cut(self, seconds: float | None = None) -> None:
        """Cut the link, for `seconds` or until `restore`; no effect when it is cut."""
        with self._lock:
            if self.is_cut:
                return
            self.is_cut = True
            self._timers.append(self.clock.call_later(self.lease, self._die))
            if seconds is not None:
                self._timers.append(self.clock.call_later(seconds, self.restore))

    def restore(self) -> None:
        """Mend the link; no effect when it is not cut."""
        with self._lock:
            if not self.is_cut:
                return
            self.is_cut = self.is_dead = False
            timers, self._timers = self._timers, []
            parts = list(self._parts)
        for timer in timers:
            timer.cancel()
        for part in parts:
            part.on_restored()

    def _die(self) -> None:
        with self._lock:
            if not self.is_cut or self._closed:
                return
            self.is_dead = True
            parts = list(self._parts)
        for part in parts:
            part.on_dead()

    def choose(self, key: str) -> Fate:
        """Return the fate of the next message on `key`, and note it."""
        with self._lock:
            number = self._counts[key]
            self._counts[key] += 1
            fate = DROPPED if self.is_cut else self.plan(key, number)
            self.sent.append(Sent(self.clock.now(), key, number, fate))
        return fate

    def later(self, delay: float, function: Callable[[], object]) -> None:
        """Call `function` after `delay` [s], unless the link is cut or the session closed then."""

        def call() -> None:
            if not (self.is_cut or self._closed):
                function()

        self.clock.call_later(delay, call)

    # -- the protocol --------------------------------------------------------------------------

    def publisher(
        self, key: str, encoding: str = "", quality: Quality = DEFAULT_QUALITY
    ) -> PublisherPort:
        return Publisher(self, key, self.inner.publisher(key, encoding, quality))

    def subscribe(
        self, key: str, callback: Callable[[Sample], None], *, history: bool = True
    ) -> Closable:
        return Subscriber(self, key, callback, history=history)

    def queryable(self, key: str, callback: Callable[[Query], None]) -> Closable:
        return Queryable(self, key, callback)

    def query(
        self,
        key: str,
        payload: bytes,
        *,
        encoding: str = "",
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Closable:
        asking = Asking(self, on_reply, on_done)
        ask = partial(
            self.inner.query,
            key,
            payload,
            encoding=encoding,
            timeout=timeout,
            on_reply=asking.take_reply,
            on_done=asking.finish,
        )
        asking.start(ask, self.choose(key), timeout)
        return asking

    def declare_alive(self, key: str) -> Closable:
        return Token(self, key)

    def watch_alive(self, pattern: str, callback: Callable[[Presence], None]) -> Closable:
        return Watcher(self, pattern, callback)

    def list_alive(self, pattern: str, timeout: float) -> list[str]:
        keys = self.inner.list_alive(pattern, timeout)
        if not self.is_dead:
            return keys
        return sorted(key for key in self.own_tokens() if key_matches(pattern, key))

    def close(self) -> None:
        with self._lock:
            self._closed = True
            timers, self._timers = self._timers, []
        for timer in timers:
            timer.cancel()
        self.inner.close()

    # -- parts ---------------------------------------------------------------------------------

    def add(self, part: Part) -> None:
        """Tell `part` of cuts from now on."""
        with self._lock:
            self._parts[part] = None

    def remove(self, part: Part) -> None:
        """Forget `part`."""
        with self._lock:
            self._parts.pop(part, None)

    def own_tokens(self) -> set[str]:
        """Return the keys of this session's tokens."""
        with self._lock:
            return {part.key for part in self._parts if isinstance(part, Token)}
