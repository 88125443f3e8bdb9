"""Callbacks on Zenoh's own threads, and the way to know that none of them will run again."""

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
    """The callbacks that Zenoh may still call: a lock for each, released when Zenoh has freed it.

    Zenoh frees a callback when it was undeclared, or its session closed, and every call of it has
    returned: it calls the callback's second function and then drops both. So the last thing that
    its thread does in Python is to free that second function. A weak reference to the function then
    releases the lock. This happens in C, without Python code, so the thread keeps the GIL until it
    leaves Python, and never asks for it again.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._held: list[tuple[threading.Lock, weakref.ref[Any]]] = []
        self._room = 64

    def add(self, last: Callable[[], object]) -> None:
        """Hold a lock until `last` is freed."""
        held = threading.Lock()
        held.acquire()
        # As `release`, but accepts an argument: weakref passes itself.
        release: Any = held.__exit__
        entry = held, weakref.ref(last, release)
        with self._lock:
            # Released entries are removed when the list is full; doubling keeps that cheap.
            if len(self._held) >= self._room:
                self._held = [entry for entry in self._held if entry[0].locked()]
                self._room = 2 * len(self._held) + 64
            self._held.append(entry)

    def wait(self, timeout: float) -> bool:
        """Wait until Zenoh has freed all present callbacks; return whether it has.

        Blocks: `timeout` [s] at most, not counting time in which the process was suspended.
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
    """Run a callback on Zenoh's thread; by default Zenoh starts a Python thread for each callback.

    Args:
        callback: Called with each item.
        ended: Called after the last call.
    """
    last = partial(ended)  # a new object, whose end `held` can watch
    held.add(last)
    return handlers.Callback(callback, last, indirect=False)
