"""Wall time: threads from a cache, one timer thread on demand, events safe in signal handlers.

It is the current clock unless `use_clock` has set another one.
"""

from __future__ import annotations

import _thread
import contextlib
import itertools
import math
import os
import threading
import time
import weakref
from contextvars import Context, ContextVar, copy_context
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock._deadlines import Deadlines
from actionlib_core.clock._protocol import check_seconds
from actionlib_core.clock._serial import report_callback, report_thread_exception
from actionlib_core.clock.forks import end_copy, is_copy

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine, Iterator

    from actionlib_core.clock._protocol import Clock

T = TypeVar("T")

IDLE_S = 5.0  # a cached thread without work ends after this
IDLE_NAME = "idle"  # name of a cached thread between two jobs


class RealEvent:
    """An event whose `set` takes no lock, so that a signal handler may call it at any moment.

    `threading.Event.set` takes a lock that the interrupted `wait` of the same thread may hold,
    which would be a deadlock. Here every waiter has a lock of its own; list operations are atomic.
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
            # Checked again: a `set` before the append could not wake this waiter.
            if self.is_set():
                return True
            if threading.get_ident() == threading.main_thread().ident:
                return _acquire_in_main(waiter, timeout) or self._flag
            longest = -1 if timeout is None else min(timeout, _MAX_WAIT_S)
            return waiter.acquire(timeout=longest) or self._flag
        finally:
            with contextlib.suppress(ValueError):  # `set` has already removed it
                self._waiters.remove(waiter)


_MAX_WAIT_S = threading.TIMEOUT_MAX
_SIGNAL_S = 0.5


def _acquire_in_main(waiter: _thread.LockType, timeout: float | None) -> bool:
    """Wait in the main thread, where signals are handled.

    A signal that arrives between Python's last check and the system call does not interrupt that
    call. Its handler would run only after the wait, perhaps never. Waiting in parts limits the
    delay to `_SIGNAL_S`; a signal that arrives during the call interrupts it at once.
    """
    deadline = None if timeout is None else time.monotonic() + timeout
    while True:
        left = _SIGNAL_S if deadline is None else deadline - time.monotonic()
        if waiter.acquire(timeout=max(0.0, min(left, _SIGNAL_S))):
            return True
        if deadline is not None and left <= _SIGNAL_S:
            return False


class RealTask:
    """A target running in a cached thread."""

    __slots__ = ("_context", "_done", "_pid", "_target", "error", "ident", "name")

    def __init__(self, target: Callable[[], object], name: str) -> None:
        self._target = target
        self.name = name
        self._context = copy_context()
        self._done = RealEvent()
        self._pid = os.getpid()
        self.ident: int | None = None
        self.error: BaseException | None = None

    def run(self) -> None:
        self.ident = threading.get_ident()
        try:
            self._context.run(self._target)
        except BaseException as error:  # noqa: BLE001  end of the thread's stack: reported
            if is_copy(self._pid):
                end_copy(error)
            self.error = error
            if not isinstance(error, SystemExit):  # which ends a thread silently, as in threading
                report_thread_exception()
        finally:
            if is_copy(self._pid):
                end_copy(None)
            self.ident = None
            del self._target, self._context  # what they refer to must not live as long as the task
            threading.current_thread().name = IDLE_NAME  # before `join` returns in other threads
            self._done.set()

    def is_alive(self) -> bool:
        return not (self._done.is_set() or is_copy(self._pid))

    def join(self, timeout: float | None = None) -> bool:
        return is_copy(self._pid) or self._done.wait(timeout)


class _Worker:
    """One cached thread: it runs the tasks that it is given, and ends when idle for `IDLE_S`."""

    def __init__(self, cache: _ThreadCache) -> None:
        self._cache = cache
        self._wake = _thread.allocate_lock()  # `give` releases it
        self._wake.acquire()
        self._task: RealTask | None = None
        self._thread = threading.Thread(target=self._run, name=IDLE_NAME, daemon=True)
        self._started = False

    def give(self, task: RealTask | None) -> None:
        """Run `task`; None only starts the thread."""
        self._task = task
        if self._started:
            self._wake.release()
        else:
            self._started = True
            self._thread.start()

    def _run(self) -> None:
        while True:
            task, self._task = self._task, None
            if task is not None:
                self._thread.name = task.name
                task.run()
            del task  # the next one may be long in coming
            self._cache.put_back(self)
            if not self._wake.acquire(timeout=IDLE_S):
                if self._cache.retire(self):
                    return
                # It is one of those to keep, or `start` has just taken it from the cache.
                self._wake.acquire()


class _ThreadCache:
    """Idle threads, newest first: starting a task in one costs only the release of a lock.

    Without a lock: list operations are atomic, and a signal handler may need a thread while the
    code that it has interrupted holds the lock.
    """

    def __init__(self) -> None:
        self._idle: list[_Worker] = []
        self._late: list[RealTask] = []  # tasks that wait, as no more threads can be started
        self._kept = 0

    def start(self, task: RealTask) -> None:
        try:
            worker = self._idle.pop()
        except IndexError:
            worker = _Worker(self)
        try:
            worker.give(task)
        except RuntimeError:
            # The system has no more threads, or the interpreter is exiting. In the second case the
            # task waits for one of the threads of `keep`.
            if threading.main_thread().is_alive() or not self._kept:
                raise
            self._late.append(task)
            self._start_late()

    def keep(self, count: int) -> None:
        """Keep `count` threads for tasks that are started while the interpreter exits.

        Python 3.12 then starts no more threads: tasks wait until one of these is free.
        """
        self._kept = max(self._kept, count)
        for _ in range(count - len(self._idle)):
            _Worker(self).give(None)

    def put_back(self, worker: _Worker) -> None:
        self._idle.append(worker)
        if self._late:
            self._start_late()

    def retire(self, worker: _Worker) -> bool:
        # Removing a worker from the list decides who owns it: `start`, or its own thread to end it.
        if len(self._idle) <= self._kept:
            return False
        try:
            self._idle.remove(worker)
        except ValueError:
            return False
        return True

    def _start_late(self) -> None:
        while self._late and self._idle:
            try:
                worker = self._idle.pop()
            except IndexError:  # another thread took it, and calls this again when it is free
                return
            try:
                task = self._late.pop(0)
            except IndexError:
                self._idle.append(worker)
            else:
                worker.give(task)


class RealTimer:
    """One call of the timer thread."""

    __slots__ = ("callback",)

    def __init__(self, callback: Callable[[], object]) -> None:
        self.callback: Callable[[], object] | None = callback

    def cancel(self) -> None:
        self.callback = None


def _is_set(_number: int, timer: RealTimer) -> bool:
    return timer.callback is not None


class RealClock:
    """Monotonic and wall time of the computer, real threads.

    All timers run in one thread, which exists only while there are timers. A forked child starts
    without the threads and timers of its parent.
    """

    def __init__(self) -> None:
        self.begin()
        _clocks.add(self)

    def begin(self) -> None:
        """Forget all threads and timers."""
        self._cache = _ThreadCache()
        # Reentrant: a signal handler that sets a timer may interrupt the code that holds the lock.
        self._timer_lock = threading.RLock()
        self._timers: Deadlines[RealTimer] = Deadlines(_is_set)
        self._timer_count = itertools.count()
        self._timers_run = False
        self._timers_changed = RealEvent()

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
        """Keep `count` threads for tasks that are spawned while the interpreter exits.

        Python 3.12 then starts no more threads; further tasks wait until one of these is free.
        """
        self._cache.keep(count)

    def call_later(self, delay: float, callback: Callable[[], object]) -> RealTimer:
        if not delay >= 0:
            check_seconds("call_later", delay)
            delay = 0.0
        timer = RealTimer(callback)
        if delay == math.inf:
            return timer
        with self._timer_lock:
            due = self.now() + delay
            self._timers.push(due, next(self._timer_count), timer)
            if not self._timers_run:
                self._start_timers()
                return timer
            first = self._timers.first()
            if first is not None and first[2] is timer:  # before the one that the thread waits for
                self._timers_changed.set()
        return timer

    def _start_timers(self) -> None:
        """Start the timer thread. Needs the lock."""
        self._timers_run = True
        try:
            # An empty context, else all timers would run in the context of the first one.
            Context().run(self.spawn, self._run_timers, name="clock-timers")
        except BaseException:  # no thread could be started: the next timer tries again
            self._timers_run = False
            raise

    def _run_timers(self) -> None:
        try:
            while (timer := self._next_timer()) is not None:
                callback, timer.callback = timer.callback, None  # from now on `cancel` is too late
                if callback is not None:
                    try:
                        callback()
                    except BaseException:  # noqa: BLE001  reported here; the other timers go on
                        report_callback("clock-timers")
                    callback = None  # nothing holds it while the next timer is waited for
        except BaseException:  # out of memory, for example: the other timers need a new thread
            with self._timer_lock:
                self._start_timers()
            raise

    def _next_timer(self) -> RealTimer | None:
        """Wait until a timer is due, remove and return it; None when there are no more timers."""
        while True:
            with self._timer_lock:
                self._timers_changed.clear()
                first = self._timers.first()
                if first is None:
                    self._timers_run = False
                    return None
                wait = first[0] - self.now()
                if wait <= 0:
                    return self._timers.pop()
            self._timers_changed.wait(wait)

    def run_async(self, main: Coroutine[object, object, T]) -> T:
        import asyncio  # here: it takes 60 ms, and most programs never need it

        with asyncio.Runner() as runner:
            return runner.run(main)


def _begin_again() -> None:
    for clock in list(_clocks):
        clock.begin()


_clocks: weakref.WeakSet[RealClock] = weakref.WeakSet()
REAL = RealClock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_begin_again)
_clock: ContextVar[Clock] = ContextVar("clock", default=REAL)


def current_clock() -> Clock:
    """Return the clock of this context: the one of `use_clock`, else the process's real clock."""
    return _clock.get()


@contextlib.contextmanager
def use_clock(clock: Clock) -> Iterator[Clock]:
    """Make `clock` the current one inside the `with` block, also for tasks spawned in it."""
    token = _clock.set(clock)
    try:
        yield clock
    finally:
        _clock.reset(token)
