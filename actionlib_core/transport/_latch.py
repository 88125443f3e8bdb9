"""Latched messages: how a subscriber tells what it has seen from what it has not.

A latched publisher's messages carry its number in its session and their own number, counted from
1; 0 answers whoever asks before the first. A subscriber gets the last message live, by asking, or
both ways in either order; `LatchFilter` lets it through once.

Threads: every method may be called from any thread.
"""

from __future__ import annotations

import struct
import threading

_FORMAT = struct.Struct("<IQ")


def pack_numbers(publisher: int, message: int) -> bytes:
    """Return what a latched message carries beside its payload."""
    return _FORMAT.pack(publisher, message)


class LatchFilter:
    """Remembers the newest message of every latched publisher of a key."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._newest: dict[tuple[str, int], int] = {}
        self._asked: dict[tuple[str, int], int] = {}

    def take_live(self, session: str, numbers: bytes) -> bool:
        """Tell whether a message that came by itself is to be delivered."""
        if len(numbers) != _FORMAT.size:
            return True
        who, message = _unpack(session, numbers)
        with self._lock:
            self._newest[who] = max(message, self._newest.get(who, 0))
            return message > self._asked.get(who, 0)

    def take_asked(self, session: str, numbers: bytes) -> bool:
        """Tell whether the answer of a latched publisher is to be delivered."""
        if len(numbers) != _FORMAT.size:
            return False
        who, message = _unpack(session, numbers)
        with self._lock:
            if message <= self._newest.get(who, 0):
                return False  # it came by itself, or nothing was sent yet
            self._newest[who] = self._asked[who] = message
            return True


def _unpack(session: str, numbers: bytes) -> tuple[tuple[str, int], int]:
    publisher, message = _FORMAT.unpack(numbers)
    return (session, int(publisher)), int(message)
