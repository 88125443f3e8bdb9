# ruff: noqa: D102  the methods of a session are documented in the protocol
"""A network inside one process, for tests and simulations: deterministic, without sockets.

A `MemoryNetwork` connects sessions. A message is put into the inbox of each receiving session, and
a timer of the clock delivers one item. With a `VirtualClock` this happens while the running thread
waits, at a moment that depends on the clock's seed; with a `RealClock` on its timer thread.

Threads: one lock per network guards all tables; no callback runs while it is held.
"""

from __future__ import annotations

import itertools
import threading
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock import current_clock
from actionlib_core.exceptions import TransportError
from actionlib_core.transport import Presence, Quality, Reply, Sample
from actionlib_core.transport._keys import check_key, compile_pattern
from actionlib_core.transport._memory_entries import (
    Entry,
    Exchange,
    Inbox,
    Publisher,
    Queryable,
    Subscriber,
    Token,
    Watcher,
)
from actionlib_core.transport.faulty import DELIVERED

if TYPE_CHECKING:
    import re
    from collections.abc import Callable

    from actionlib_core.clock import Clock
    from actionlib_core.transport import Query
    from actionlib_core.transport.faulty import FaultyTransport

E = TypeVar("E", bound=Entry)

DEFAULT_QUALITY = Quality()


class MemoryNetwork:
    """Connects the sessions of one process.

    Args:
        clock: Delivers the messages; None: the current clock.
    """

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock = clock if clock is not None else current_clock()
        self.lock = threading.Lock()
        self.subscribers: dict[str, list[Subscriber]] = {}
        self.queryables: dict[str, list[Queryable]] = {}
        self.latches: dict[str, list[Publisher]] = {}
        self.watchers: list[Watcher] = []
        self._tokens: dict[str, int] = {}
        self._ids = itertools.count(1)

    def session(self) -> MemoryTransport:
        """Open a session."""
        return MemoryTransport(self, f"{next(self._ids):032x}")

    def count_token(self, key: str, step: int) -> None:
        """Count a token up or down; watchers are notified of its first and last. Needs the lock."""
        before = self._tokens.pop(key, 0)
        after = before + step
        if after:
            self._tokens[key] = after
        if bool(before) != bool(after):
            for watcher in self.watchers:
                if watcher.pattern.fullmatch(key + "/"):
                    watcher.inbox.post(watcher, Presence(key, alive=bool(after)))

    def match_tokens(self, pattern: re.Pattern[str]) -> list[str]:
        """Return the tokens that match a compiled pattern. Needs the lock."""
        return sorted(key for key in self._tokens if pattern.fullmatch(key + "/"))


class MemoryTransport:
    """One session of a `MemoryNetwork`."""

    def __init__(self, network: MemoryNetwork, session_id: str) -> None:
        self.network = network
        self.inbox = Inbox(network.clock)
        self.declared: dict[Entry, None] = {}
        self.killed = False
        self.link: FaultyTransport | None = None
        self._session_id = session_id
        self._closed = False

    @property
    def session_id(self) -> str:
        """This session's id."""
        return self._session_id

    @property
    def is_cut(self) -> bool:
        """Whether the session's link is cut."""
        return self.link is not None and self.link.is_cut

    @property
    def rediscovery(self) -> float:
        """0: no link is ever lost."""
        return 0.0

    @property
    def lost_link(self) -> str:
        """Nothing: no link is ever lost."""
        return ""

    @property
    def is_linked(self) -> bool:
        """True: whoever else is on the network is known at once."""
        return True

    @property
    def link_delay(self) -> float:
        """0, likewise."""
        return 0.0

    @property
    def is_local(self) -> bool:
        """True: the network lives in this process."""
        return True

    def publisher(
        self,
        key: str,
        encoding: str = "",
        quality: Quality = DEFAULT_QUALITY,
        *,
        kept: bytes | None = None,
    ) -> Publisher:
        check_key(key)
        return self._declare(lambda: Publisher(self, key, encoding, quality, kept), key)

    def subscribe(
        self,
        key: str,
        callback: Callable[[Sample], None],
        *,
        history: bool = True,
        cached: int = 0,
    ) -> Subscriber:
        check_key(key)
        make = partial(Subscriber, self, key, callback, history=history, cached=cached)
        return self._declare(make, key)

    def queryable(
        self, key: str, callback: Callable[[Query], None], *, complete: bool = False
    ) -> Queryable:
        check_key(key)
        return self._declare(lambda: Queryable(self, key, callback, complete=complete), key)

    def query(
        self,
        key: str,
        payload: bytes,
        *,
        encoding: str = "",
        attachment: bytes | None = None,
        best: bool = False,
        timeout: float,
        on_reply: Callable[[Reply], None],
        on_done: Callable[[], None],
    ) -> Exchange:
        check_key(key)
        exchange = self._declare(lambda: Exchange(self, timeout, on_reply, on_done), key)
        fate = DELIVERED if self.link is None else self.link.choose(key)
        ask = partial(exchange.ask, key, payload, encoding, attachment, best=best)
        if self.link is not None and fate and fate[0] > 0:
            self.link.later(fate[0], ask)
        elif fate:
            ask()
        return exchange

    def declare_alive(self, key: str) -> Token:
        check_key(key)
        return self._declare(lambda: Token(self, key), key)

    def watch_alive(self, pattern: str, callback: Callable[[Presence], None]) -> Watcher:
        return self._declare(lambda: Watcher(self, pattern, callback), pattern)

    def list_alive(self, pattern: str, timeout: float) -> list[str]:  # noqa: ARG002  answers at once
        compiled = compile_pattern(pattern)
        with self.network.lock:
            self._check_open(pattern)
            if self.link is not None and self.link.is_dead:
                return self.own_tokens(compiled)
            return self.network.match_tokens(compiled)

    def own_tokens(self, pattern: re.Pattern[str]) -> list[str]:
        """Return this session's tokens that match a compiled pattern. Needs the lock."""
        own = {entry.key for entry in self.declared if isinstance(entry, Token)}
        return sorted(key for key in own if pattern.fullmatch(key + "/"))

    def close(self) -> None:
        self._end(wait=True)

    def kill(self) -> None:
        """End as a process does that gets SIGKILL: its tokens vanish, none of its callbacks runs.

        Its threads, which a test cannot kill, go on in an empty network, without errors.
        """
        # Without waiting for callbacks, as a killed process does not either.
        self.killed = True
        self._end(wait=False)
        self.network = MemoryNetwork(self.network.clock)
        self._closed = False

    def _end(self, *, wait: bool) -> None:
        with self.network.lock:
            self._closed = True
            for entry in list(self.declared):
                entry.close_locked()
        self.inbox.shut(wait=wait)

    def _declare(self, make: Callable[[], E], key: str) -> E:
        with self.network.lock:
            self._check_open(key)
            entry = make()
            self.declared[entry] = None
            return entry

    @property
    def is_open(self) -> bool:
        """Whether the session has not been closed."""
        return not self._closed

    def _check_open(self, key: str) -> None:
        if self._closed:
            raise TransportError(
                f"{key}: the session is closed. Try using a node that is still open."
            )
