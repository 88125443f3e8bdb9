"""Take messages one by one while they are rare, and many at once when they come in bursts."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Generic, TypeVar

from actionlib_core.clock._serial import report_thread_exception

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock

T = TypeVar("T")

RAPID_S = 0.5e-3  # messages closer than this follow each other rapidly
RAPID = 8  # so many of them make a burst
PAUSE_S = 1e-3  # in a burst they are gathered for so long


class Bursts(Generic[T]):
    """Hands items on, in order: at once, or in a burst a little later and together.

    A thread of the network that hands on each message of a burst changes places with the thread
    that works on it thousands of times a second, which takes longer than the work.

    Args:
        clock: Gives time.
        spawn: Runs a function in another thread, which has a name.
        handle: Takes an item; never by two threads at once.

    Threads: `take` and `flush` are called by the network's threads.
    """

    __slots__ = ("_called", "_clock", "_handle", "_last", "_lock", "_rapid", "_spawn", "_waiting")

    def __init__(
        self,
        clock: Clock,
        spawn: Callable[[Callable[[], object], str], object],
        handle: Callable[[T], object],
    ) -> None:
        self._clock = clock
        self._spawn = spawn
        self._handle = handle
        self._lock = threading.Lock()
        self._waiting: deque[T] = deque()
        self._called = False
        self._rapid = 0
        self._last = float("-inf")

    def take(self, item: T) -> None:
        """Hand `item` on, now or soon."""
        now = self._clock.now()
        self._rapid = self._rapid + 1 if now - self._last < RAPID_S else 0
        self._last = now
        if self._rapid < RAPID and not self._called:
            with self._lock:
                self._handle(item)
            return
        self._waiting.append(item)
        if not self._called:
            self._called = True
            self._spawn(self._gather, "feedback")

    def flush(self) -> None:
        """Hand everything on that was taken before."""
        with self._lock:
            self._hand_on()

    def _gather(self) -> None:
        self._clock.sleep(PAUSE_S)
        with self._lock:
            self._hand_on()
            self._called = False
            self._hand_on()  # what came in between, when nobody was called

    def _hand_on(self) -> None:
        waiting = self._waiting
        while waiting:
            try:
                self._handle(waiting.popleft())
            except Exception:  # noqa: BLE001  a border: reported, the next item is handed on
                report_thread_exception()
