"""Watches of single keys that share one subscriber of their session.

Zenoh walks all tokens that it knows for each new subscriber to tokens, and all subscribers for each
new token. A thousand servers in one program, each with a watch of its own name, would take a
million steps. So when a session has some watches whose patterns differ in the last word only, the
next ones share a subscriber with `*` in its place, until the session ends. It also answers lists of
such patterns.
"""

from __future__ import annotations

import threading
from collections import Counter, defaultdict
from typing import TYPE_CHECKING, Final

from actionlib_core.transport import Presence
from actionlib_core.transport.zenoh._declared import Declared, Watcher

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.transport.zenoh import ZenohTransport

FEW: Final = 8
"""So many watches of a group have subscribers of their own, which get no more than they need."""


class Watches:
    """The watches of a session, by groups: patterns with the same words but for the last one.

    Threads: any. Locks are not held while Zenoh or a callback is called.
    """

    def __init__(self, transport: ZenohTransport) -> None:
        self._transport = transport
        self._lock = threading.Lock()
        self._groups: dict[str, _Group] = {}
        # Tokens of this session, which it knows before they are heard: by last word, with counts.
        self._own: defaultdict[str, Counter[str]] = defaultdict(Counter)

    def new(self, pattern: str, callback: Callable[[Presence], None]) -> Declared:
        """Declare a watch.

        Raises:
            ZError: the session is closed.
        """
        wide = wide_pattern(pattern)
        if wide is None or self._transport.is_restricted:
            return Watcher(self._transport, pattern, callback)
        with self._lock:
            group = self._groups.setdefault(wide, _Group(self._transport, wide))
        return group.new(pattern, callback)

    def note_own(self, key: str, change: int) -> None:
        """Note that this session has declared (1) or undeclared (-1) a token."""
        last = key.rpartition("/")[2]
        with self._lock:
            own = self._own[last]
            own[key] += change
            is_there = own[key] > 0
            if not is_there:
                del own[key]
            if not own:
                del self._own[last]
            groups = list(self._groups.values())
        for group in groups:
            group.note_own(key, is_there=is_there)

    def known(self, pattern: str) -> list[str] | None:
        """Return the tokens that match a pattern; None if the network must be asked."""
        group = self._groups.get(wide_pattern(pattern) or "")
        if group is None or not group.is_complete:
            return None
        words = pattern.split("/")
        with self._lock:
            own = [key for key in self._own.get(words[-1], ()) if _matches(words, key)]
        return sorted({*group.alive_of(words), *own})

    def asks_for(self, pattern: str) -> str:
        """Return the pattern to ask for, so that lists like this one are known from now on."""
        wide = wide_pattern(pattern) or ""
        return wide if wide in self._groups and self._groups[wide].is_shared else pattern

    def answered(self, pattern: str, found: Iterable[str]) -> None:
        """Note the answer of the network to a pattern of `asks_for`."""
        group = self._groups.get(pattern)
        if group is not None:
            group.compare(found)


def wide_pattern(pattern: str) -> str | None:
    """Return the pattern of a group; None for a pattern whose last word is not one exact word."""
    head, _, last = pattern.rpartition("/")
    if not head or "*" in last or last.startswith("@") or "**" in head.split("/"):
        return None
    return f"{head}/*"


def _matches(words: list[str], key: str) -> bool:
    """Return whether a key matches the words of a pattern without `**`."""
    found = key.split("/")
    return len(found) == len(words) and all(
        word == one or (word == "*" and not one.startswith("@"))
        for word, one in zip(words, found, strict=True)
    )


class _Group:
    """The watches of one group."""

    def __init__(self, transport: ZenohTransport, pattern: str) -> None:
        self._transport = transport
        self._pattern = pattern
        self._lock = threading.Lock()
        self._few = 0
        self._served: defaultdict[str, dict[_Served, None]] = defaultdict(dict)  # by last word
        self._alive: defaultdict[str, set[str]] = defaultdict(set)  # by last word
        # Own tokens that were undeclared and not yet reported so. (Their keys are of one session.)
        self._gone: set[str] = set()
        self.is_shared = False
        self.is_complete = False

    def new(self, pattern: str, callback: Callable[[Presence], None]) -> Declared:
        """Declare a watch: a few ones have subscribers of their own."""
        last = pattern.rpartition("/")[2]
        with self._lock:
            alone = not self.is_shared and self._few < FEW
            if alone:
                self._few += 1
            else:
                opens, self.is_shared = not self.is_shared, True
                served = _Served(self._transport, pattern, callback, self)
                self._served[last][served] = None
                # Queued under the lock, so that no later change comes before it.
                for key in self._alive.get(last, set()) - self._gone:
                    served.hear(Presence(key, alive=True))
        if alone:
            return _Few(self._transport, pattern, callback, self)
        if opens:
            self._transport.keep(Watcher(self._transport, self._pattern, self._hear))
        return served

    def _hear(self, presence: Presence) -> None:
        key, alive = presence
        last = key.rpartition("/")[2]
        with self._lock:
            if alive and key in self._gone:
                return
            known = self._alive[last]
            (known.add if alive else known.discard)(key)
            if not known:
                del self._alive[last]
            if not alive:
                self._gone.discard(key)
            hearers = list(self._served.get(last, ()))
        for hearer in hearers:
            hearer.hear(presence)

    def forget(self, watch: Declared, last: str) -> None:
        """Remove a watch."""
        with self._lock:
            if isinstance(watch, _Few):
                self._few -= 1
                return
            self._served[last].pop(watch, None)  # type: ignore[call-overload]
            if not self._served[last]:
                del self._served[last]

    def alive_of(self, words: list[str]) -> list[str]:
        """Return the tokens that match the words of a pattern of this group."""
        with self._lock:
            found = self._alive.get(words[-1], set()) - self._gone
        return [key for key in found if _matches(words, key)]

    def note_own(self, key: str, *, is_there: bool) -> None:
        """Note that this session has declared or undeclared a token."""
        with self._lock:
            if is_there or not self.is_shared:
                self._gone.discard(key)
            elif _matches(self._pattern.split("/"), key):
                self._gone.add(key)

    def compare(self, found: Iterable[str]) -> None:
        """Compare with the answer of the network: all of it heard, lists need not ask any more."""
        with self._lock:
            heard = set().union(*self._alive.values())
            self.is_complete = self.is_complete or heard.issuperset(found)


class _Few(Watcher):
    """A watch of a group with a subscriber of its own."""

    def __init__(
        self,
        transport: ZenohTransport,
        pattern: str,
        callback: Callable[[Presence], None],
        group: _Group,
    ) -> None:
        super().__init__(transport, pattern, callback)
        self._group = group

    def close(self) -> None:
        was_open = not self._inlet.closed
        super().close()
        if was_open:
            self._group.forget(self, "")


class _Served(Declared):
    """A watch of a group that shares a subscriber."""

    def __init__(
        self,
        transport: ZenohTransport,
        pattern: str,
        callback: Callable[[Presence], None],
        group: _Group,
    ) -> None:
        super().__init__(transport)
        self._words = pattern.split("/")
        self._callback = callback
        self._group = group
        self._alive: set[str] = set()

    def hear(self, presence: Presence) -> None:
        """Deliver a token that matches."""
        if _matches(self._words, presence.key):
            self._inlet.take(self._deliver, presence)

    def _deliver(self, presence: Presence) -> None:
        key, alive = presence
        if alive != (key in self._alive):
            (self._alive.add if alive else self._alive.discard)(key)
            self._callback(presence)

    def close(self) -> None:
        super().close()
        self._group.forget(self, self._words[-1])
