"""Bounded collections: a queue of messages for a slow reader, and a set of recent keys."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")

MESSAGES = 100_000  # limit of a queue
BYTES = 32 * 2**20  # its other limit; one message alone may be larger


class Backlog(Generic[T]):
    """A bounded queue: when it is full, the oldest message is dropped and counted.

    Args:
        messages: Limit on their number.
        size: Limit on their total size [bytes]; the newest message is kept whatever its size.

    Attributes:
        dropped: Number of messages dropped so far.

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
        """Append a message of `size` bytes; return whether no other had to be dropped for it."""
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
        """Remove and return the oldest message; None when the queue is empty."""
        if not self._waiting:
            return None
        message, size = self._waiting.popleft()
        self._bytes -= size
        return message

    def drop_all(self) -> int:
        """Drop all messages; return their number."""
        count = len(self._waiting)
        self._waiting.clear()
        self._bytes = 0
        self.dropped += count
        return count


class Recent(dict[str, None]):
    """A set of words with a limit on its size: the word added first is dropped first.

    Adding a word again does not make it newer: a dict keeps the order of first insertion.
    """

    def __init__(self, limit: int) -> None:
        super().__init__()
        self._limit = limit

    def add(self, word: str) -> None:
        """Add a word."""
        self[word] = None
        if len(self) > self._limit:
            del self[next(iter(self))]
