"""Incoming messages of actions: checks of their types, and bursts that are handed on together."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Generic, TypeVar

from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.exceptions import TypeMismatchError
from actionlib_core.goal.bounded import Recent
from actionlib_core.wire.encoding import check_encoding, encoding_of

if TYPE_CHECKING:
    import logging
    from collections.abc import Callable

    from actionlib_core.clock import Clock
    from actionlib_core.exceptions import ActionlibError
    from actionlib_core.transport import Sample
    from actionlib_core.wire.encoding import Typed

T = TypeVar("T")

RAPID_S = 0.5e-3  # messages with shorter intervals may belong to a burst
RAPID = 8  # a burst begins after this number of them
PAUSE_S = 1e-3  # the messages of a burst are gathered for this time
REPORTED = 1000  # remembered reports; limited, since a sender can invent names without end


class Readable:
    """Checks the types of samples; logs dropped ones, once per kind.

    Threads: any.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._lock = threading.Lock()  # guards `_reported`
        self._reported = Recent(REPORTED)
        self._encodings: dict[type[Typed], str] = {}

    def check(self, sample: Sample, message_class: type[Typed]) -> bool:
        """Return whether `message_class` can read a sample; if not, report sender and type."""
        encoding = self._encodings.get(message_class)
        if encoding is None:
            encoding = self._encodings.setdefault(message_class, encoding_of(message_class))
        if sample.encoding == encoding:  # the usual case, without parsing
            return True
        try:
            check_encoding(
                sample.encoding,
                message_class,
                name=sample.key,
                sender=f"session {sample.source or 'unknown'}",
            )
        except TypeMismatchError as error:
            self.report(f"{sample.source} {sample.encoding}", error)
            return False
        return True

    def report(self, about: str, error: ActionlibError) -> None:
        """Log an error, unless one with the same `about` was logged before."""
        with self._lock:
            known = about in self._reported
            self._reported.add(about)
        if not known:
            self._log.error("%s", error)


class Bursts(Generic[T]):
    """Hands items on in order: single ones at once, those of a burst together, a little later.

    Without this, the network's thread and the thread that handles the items would switch for each
    message of a burst, thousands of times a second, which takes longer than the work itself.

    Args:
        clock: The clock.
        spawn: Runs a function in another thread with the given name.
        handle: Handles an item; never called by two threads at once.

    Attributes:
        waiting: Items that were taken and not yet handed on.
        lock: Held while an item is handed on. If nothing waits and then the lock is free,
            everything was handed on; the two are to be read in this order.

    Threads: `take` and `flush` are called by the network's threads.
    """

    __slots__ = ("_called", "_clock", "_handle", "_last", "_rapid", "_spawn", "lock", "waiting")

    def __init__(
        self,
        clock: Clock,
        spawn: Callable[[Callable[[], object], str], object],
        handle: Callable[[T], object],
    ) -> None:
        self._clock = clock
        self._spawn = spawn
        self._handle = handle
        self.lock = threading.Lock()
        self.waiting: deque[T] = deque()
        self._called = False  # the thread that gathers was started
        # Without a lock: if threads miscount, a burst begins a few messages earlier or later.
        self._rapid = 0
        self._last = float("-inf")

    def take(self, item: T) -> None:
        """Hand `item` on, now or soon."""
        now = self._clock.now()
        self._rapid = self._rapid + 1 if now - self._last < RAPID_S else 0
        self._last = now
        if self._rapid < RAPID and not self._called:
            with self.lock:
                self._handle(item)
            return
        self.waiting.append(item)
        if not self._called:
            self._called = True
            try:
                self._spawn(self._gather, "feedback")
            except RuntimeError:  # the system has no thread left
                self._called = False
                self.flush()

    def flush(self) -> None:
        """Hand on everything that was taken before."""
        with self.lock:
            if self.waiting:
                self._hand_on()

    def _gather(self) -> None:
        self._clock.sleep(PAUSE_S)
        with self.lock:
            self._hand_on()
            self._called = False
            # Once more: an item taken before the line above has started no other thread.
            self._hand_on()

    def _hand_on(self) -> None:
        waiting = self.waiting
        while waiting:
            try:
                self._handle(waiting.popleft())
            except Exception:  # noqa: BLE001  reported here, so that the next item is handed on
                report_thread_exception()
