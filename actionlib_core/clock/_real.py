"""Wall time: threads from a cache, one timer thread on demand, events safe in signal handlers."""

from __future__ import annotations

import _thread
import contextvars
import heapq
import itertools
import math
import threading
import time
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock._protocol import check_seconds
from actionlib_core.clock._serial import report_callback, report_thread_exception
from actionlib_core.clock._threads import ThreadCache, mark_idle

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

T = TypeVar("T")


class RealEvent:
    """An event whose `set` takes no lock, so that a signal handler may call it at any moment.

    `threading.Event.set` takes a lock that the interrupted `wait` of the same thread may hold.
    Here every waiter brings a lock of its own; list operations are atomic.
    """

    __slots__ = ("_flag", "_waiters")

    def __init__(self) -> None:
        self._flag = False
        self._waiters: list[_thread.LockType] = []

    def is_set(self) -> bool:
        return self._flag

    def set(self) -> None:
        self._flag = True
        while self._waiters:
            try:
                waiter = self._waiters.pop()
            except IndexError:  # another `set` took the last one
                return
            waiter.release()

    def clear(self) -> None:
        self._flag = False

    def wait(self, timeout: float | None = None) -> bool:
        if self._flag:
            return True
        if timeout is not None and not timeout > 0:
            check_seconds("wait", timeout)
            return False
        waiter = _thread.allocate_lock()
        waiter.acquire()
        try:
            self._waiters.append(waiter)
            # Set between the first look and the append: nobody may wake us.
            if self.is_set():
                return True
            if threading.get_ident() == threading.main_thread().ident:
                return _acquire_in_main(waiter, timeout) or self.is_set()
            longest = -1 if timeout is None else min(timeout, _LONGEST_S)
            return waiter.acquire(timeout=longest) or self.is_set()
        finally:
            self._forget(waiter)

    def _forget(self, waiter: _thread.LockType) -> None:
        try:
            self._waiters.remove(waiter)
        except ValueError:  # `set` has already taken it
            return


_LONGEST_S = threading.TIMEOUT_MAX
_UNHEARD_S = 0.5


def _acquire_in_main(waiter: _thread.LockType, timeout: float | None) -> bool:
    """Wait in the main thread, where signals are handled.

    A signal that comes between Python's last look and the system call does not end that call, so
    that its handler would run when the wait is over, maybe never. Looking up now and then bounds
    the delay to `_UNHEARD_S`; a signal that comes later ends the call at once.
    """
    deadline = None if timeout is None else time.monotonic() + timeout
    while True:
        left = _UNHEARD_S if deadline is None else deadline - time.monotonic()
        if waiter.acquire(timeout=max(0.0, min(left, _UNHEARD_S))):
            return True
        if deadline is not None and left <= _UNHEARD_S:
            return False


class RealTask:
    """A target running in a cached thread."""

    __slots__ = ("_context", "_done", "_ident", "_target", "error", "name")

    def __init__(self, target: Callable[[], object], name: str) -> None:
        self._target = target
        self._context = contextvars.copy_context()
        self._done = RealEvent()
        self._ident: int | None = None
        self.name = name
        self.error: BaseException | None = None

    @property
    def ident(self) -> int | None:
        return self._ident

    def run(self) -> None:
        self._ident = threading.get_ident()
        try:
            self._context.run(self._target)
        except BaseException as error:  # noqa: BLE001  the thread's border: kept and reported
            self.error = error
            if not isinstance(error, SystemExit):
                report_thread_exception()
        finally:
            self._ident = None
            del self._target, self._context
            mark_idle()
            self._done.set()

    def is_alive(self) -> bool:
        return not self._done.is_set()

    def join(self, timeout: float | None = None) -> bool:
        return self._done.wait(timeout)


class RealTimer:
    """One entry of the timer thread."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback: Callable[[], object] | None = callback

    def cancel(self) -> None:
        self.callback = None


class _TimerThread:
    """All timers of a clock in one thread, which exists while there are timers."""

    def __init__(self, clock: RealClock) -> None:
        self._clock = clock
        # Re-entrant: a signal handler that sets a timer may interrupt the code that holds it.
        self._lock = threading.RLock()
        self._heap: list[tuple[float, int, RealTimer]] = []
        self._count = itertools.count()
        self._running = False
        self._changed = RealEvent()

    def add(self, delay: float, timer: RealTimer) -> None:
        check_seconds("call_later", delay)
        if delay == math.inf:
            return
        with self._lock:
            due = self._clock.now() + max(delay, 0.0)
            heapq.heappush(self._heap, (due, next(self._count), timer))
            if not self._running:
                self._start()
            elif self._heap[0][2] is timer:
                self._changed.set()

    def _start(self) -> None:
        """Start the thread; with the lock held."""
        self._running = True
        try:
            # An empty context: timers belong to the clock, not to who came first.
            contextvars.Context().run(self._clock.spawn, self._run, name="clock-timers")
        except BaseException:  # the system gives no thread: the next timer tries again
            self._running = False
            raise

    def _run(self) -> None:
        try:
            self._call_all()
        except BaseException:  # out of memory, for one: the timers that are left need a thread
            with self._lock:
                self._start()
            raise

    def _call_all(self) -> None:
        while True:
            with self._lock:
                self._changed.clear()
                while self._heap and self._heap[0][2].callback is None:
                    heapq.heappop(self._heap)
                if not self._heap:
                    self._running = False
                    return
                wait = self._heap[0][0] - self._clock.now()
                timer = heapq.heappop(self._heap)[2] if wait <= 0 else None
            if timer is None:
                self._changed.wait(wait)
                continue
            callback, timer.callback = timer.callback, None
            if callback is not None:
                try:
                    callback()
                except BaseException:  # noqa: BLE001  a border: reported, other timers go on
                    report_callback("clock-timers")


class RealClock:
    """Monotonic and wall time of the computer, real threads."""

    def __init__(self) -> None:
        self._cache = ThreadCache()
        self._timers = _TimerThread(self)

    now = staticmethod(time.monotonic)
    time_ns = staticmethod(time.time_ns)

    def sleep(self, seconds: float) -> None:
        if seconds > 0:
            time.sleep(seconds)
        else:
            check_seconds("sleep", seconds)

    def event(self, name: str = "an event") -> RealEvent:  # noqa: ARG002  for virtual time
        return RealEvent()

    def spawn(self, target: Callable[[], object], *, name: str) -> RealTask:
        task = RealTask(target, name)
        self._cache.start(task)
        return task

    def keep_threads(self, count: int) -> None:
        """Have `count` threads ready for what is spawned while the program ends.

        Python 3.12 starts no thread then; more tasks than that wait for one another.
        """
        self._cache.keep(count)

    def call_later(self, delay: float, callback: Callable[[], object]) -> RealTimer:
        timer = RealTimer(callback)
        self._timers.add(delay, timer)
        return timer

    def run_async(self, main: Coroutine[object, object, T]) -> T:
        import asyncio  # 60 ms that most programs never need

        with asyncio.Runner() as runner:
            return runner.run(main)
