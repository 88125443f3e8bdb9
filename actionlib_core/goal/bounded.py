"""Memories with a limit: messages that wait for a slow reader, and what was seen lately."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")

MESSAGES = 100_000  # that many may wait
BYTES = 32 * 2**20  # and that much; the newest message always may


class Backlog(Generic[T]):
    """A bounded queue: when it is full, the oldest message is dropped and counted.

    Args:
        messages: How many may wait.
        size: How large they may be together [bytes].

    Attributes:
        dropped: How many were dropped.

    Threads: none of its own, no lock; the owner calls it under its lock.
    """

    __slots__ = ("_bytes", "_messages", "_size", "_waiting", "dropped")

    def __init__(self, messages: int = MESSAGES, size: int = BYTES) -> None:
        self._messages = messages
        self._size = size
        self._bytes = 0
        self._waiting: deque[tuple[T, int]] = deque()
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, message: T, size: int) -> bool:
        """Append a message of `size` bytes; return whether it fitted without dropping another."""
        self._waiting.append((message, size))
        self._bytes += size
        dropped = self.dropped
        while len(self._waiting) > self._messages or (
            self._bytes > self._size and len(self._waiting) > 1
        ):
            self.take()
            self.dropped += 1
        return self.dropped == dropped

    def take(self) -> T | None:
        """Return the oldest message and remove it; None when none waits."""
        if not self._waiting:
            return None
        message, size = self._waiting.popleft()
        self._bytes -= size
        return message

    def drop_all(self) -> int:
        """Drop what waits; return how many messages that were."""
        count = len(self._waiting)
        self._waiting.clear()
        self._bytes = 0
        self.dropped += count
        return count


class Recent(dict[str, None]):
    """Words that were added; beyond the limit, those that came first are forgotten.

    A word that comes again keeps its place.
    """

    def __init__(self, limit: int) -> None:
        super().__init__()
        self._limit = limit

    def add(self, word: str) -> None:
        """Keep a word."""
        self[word] = None
        if len(self) > self._limit:
            del self[next(iter(self))]
