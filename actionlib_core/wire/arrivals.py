"""What arrives at either end of an action: which samples can be read, and what comes in bursts."""

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

RAPID_S = 0.5e-3  # messages closer than this follow each other rapidly
RAPID = 8  # so many of them make a burst
PAUSE_S = 1e-3  # in a burst they are gathered for so long
TOLD = 1000  # what was reported is remembered so far back; senders can be made up


class Readable:
    """Checks the types of samples; reports what is dropped once of each kind, to `log`.

    Threads: any.
    """

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._lock = threading.Lock()  # guards `_told`
        self._told = Recent(TOLD)
        self._encodings: dict[type[Typed], str] = {}

    def check(self, sample: Sample, message_class: type[Typed]) -> bool:
        """Tell whether `message_class` reads a sample; if not, report its sender and type."""
        encoding = self._encodings.get(message_class)
        if encoding is None:
            encoding = self._encodings.setdefault(message_class, encoding_of(message_class))
        if sample.encoding == encoding:  # the usual case; anything else is parsed
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
        """Log an error, unless one about the same was: a sender may go on like this."""
        with self._lock:
            known = about in self._told
            self._told.add(about)
        if not known:
            self._log.error("%s", error)


class Bursts(Generic[T]):
    """Hands items on, in order: at once, or in a burst a little later and together.

    A thread of the network that hands on each message of a burst changes places with the thread
    that works on it thousands of times a second, which takes longer than the work.

    Args:
        clock: Gives time.
        spawn: Runs a function in another thread, which has a name.
        handle: Takes an item; never by two threads at once.

    Attributes:
        waiting: What was taken and not yet handed on.
        lock: Held while an item is handed on. When nothing waits, and then nobody holds it,
            everything was handed on.

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
        self._called = False  # the thread that gathers is under way
        # Without a lock: threads that miscount only begin a burst sooner or later.
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
            self._spawn(self._gather, "feedback")

    def flush(self) -> None:
        """Hand everything on that was taken before."""
        with self.lock:
            if self.waiting:
                self._hand_on()

    def _gather(self) -> None:
        self._clock.sleep(PAUSE_S)
        with self.lock:
            self._hand_on()
            self._called = False
            self._hand_on()  # what came in between, when nobody was called

    def _hand_on(self) -> None:
        waiting = self.waiting
        while waiting:
            try:
                self._handle(waiting.popleft())
            except Exception:  # noqa: BLE001  a border: reported, the next item is handed on
                report_thread_exception()
