"""Callbacks on zenoh's own threads, and the proof that none of them will enter Python again."""

from __future__ import annotations

import threading
import weakref
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from zenoh import handlers

from actionlib_core.clock._ending import PART_S

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class Held:
    """What zenoh may still call: for each callback a lock, released when zenoh has let go of it.

    Zenoh lets go of a callback when it was undeclared, or its session closed, and every call of it
    has returned: it calls the callback's second function, and then drops both. The last thing that
    its thread does in Python is to free that second function. A weak reference to it releases the
    lock then, in C and not in Python code, so that the thread cannot lose the interpreter between
    that and its way out, and never has to ask for it again.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._held: list[tuple[threading.Lock, weakref.ref[Any]]] = []
        self._room = 64

    def add(self, last: Callable[[], object]) -> None:
        """Hold a lock until `last` is freed."""
        held = threading.Lock()
        held.acquire()
        release: Any = held.__exit__  # as `release`, but takes the argument that it gets here
        entry = held, weakref.ref(last, release)
        with self._lock:
            if len(self._held) >= self._room:
                self._held = [entry for entry in self._held if entry[0].locked()]
                self._room = 2 * len(self._held) + 64
            self._held.append(entry)

    def wait(self, timeout: float) -> bool:
        """Wait until zenoh has let go of everything there is now; return whether it has.

        Blocks: `timeout` [s] at most, not counting a time in which the process was stopped.
        """
        left = timeout
        with self._lock:
            locks = [lock for lock, _ in self._held if lock.locked()]
        for lock in locks:
            while not lock.acquire(timeout=min(left, PART_S)):
                left -= PART_S
                if left <= 0.0:
                    return False
            lock.release()
        return True


held = Held()


def direct(
    callback: Callable[[T], None], ended: Callable[[], object] = bool
) -> handlers.Callback[T]:
    """Run a callback on zenoh's thread; zenoh's default starts a Python thread for each.

    Args:
        callback: Gets each item.
        ended: Called after the last call.
    """
    last = partial(ended)
    held.add(last)
    return handlers.Callback(callback, last, indirect=False)
