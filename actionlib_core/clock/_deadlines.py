"""The deadlines of a clock: a heap from which entries that no longer count disappear."""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")

SPARE = 64  # entries that no longer count, beside as many as those that do


class Deadlines(Generic[T]):
    """Deadlines with what is due then, the next one first.

    Most timers are cancelled long before they are due: a timeout of a day would stay here for a
    day. So when there are more than twice as many entries as counted the last time, those that no
    longer count are removed, which costs each `push` a constant time.

    Args:
        counts: Returns whether an entry still counts, from its number and what is due.

    Threads: none of its own, no lock; the owner calls it under its lock, which may be reentrant: a
        signal handler may call it in the middle of each method, wherever Python code runs.
    """

    __slots__ = ("_cleaning", "_counts", "_entries", "_room")

    def __init__(self, counts: Callable[[int, T], bool]) -> None:
        self._counts = counts
        self._entries: list[tuple[float, int, T]] = []
        self._room = SPARE
        self._cleaning = object()

    def __len__(self) -> int:
        return len(self._entries)

    def push(self, due: float, number: int, what: T) -> None:
        """Add a deadline.

        Args:
            due: When [s, clock].
            number: Unique; of two entries that are due together, the smaller comes first.
            what: What is due.
        """
        entries = self._entries
        if len(entries) >= self._room:
            mine = self._cleaning = object()
            kept = [entry for entry in entries if self._counts(entry[1], entry[2])]
            heapq.heapify(kept)
            if self._cleaning is mine:  # else the `push` of a signal handler has cleaned meanwhile
                entries[:] = kept
                self._room = 2 * len(kept) + SPARE
        heapq.heappush(entries, (due, number, what))

    def first(self) -> tuple[float, int, T] | None:
        """Return the next entry that counts; those before it are removed."""
        entries = self._entries
        while entries:
            entry = entries[0]
            if self._counts(entry[1], entry[2]):
                return entry
            if entries and entries[0] is entry:  # a signal handler may have set an earlier one
                heapq.heappop(entries)
        return None

    def pop(self) -> T:
        """Remove the next entry, after `first`, and return what is due."""
        return heapq.heappop(self._entries)[2]

    def clear(self) -> None:
        """Remove all entries."""
        self._entries.clear()
