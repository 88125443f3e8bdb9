"""The shutdown of the program as one event: requested by a signal, by the program, or by a test.

    with shutdown.handle_signals():
        shutdown.on_shutdown(machine.request_preempt)
        machine.execute()

The first SIGINT or SIGTERM requests the shutdown. A second SIGINT raises KeyboardInterrupt, as by
default in Python, and a third one ends the process at once; a second SIGTERM ends it at once.

Tests use a `Shutdown` of their own (`use_shutdown`) and request it by hand.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import threading
import weakref
from contextvars import ContextVar
from typing import TYPE_CHECKING, Protocol

from actionlib_core.clock import RealClock, SerialExecutor, current_clock
from actionlib_core.clock._serial import report_thread_exception

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import FrameType

    from actionlib_core.clock import Clock, Event

EXIT_THREADS = 4  # for timers, callbacks, and two for a machine that is preempted


class Stoppable(Protocol):
    """A run that ends on request."""

    @property
    def clock(self) -> Clock:
        """The clock of its threads."""
        ...

    def stop(self) -> None:
        """Ask it to end; may block."""


class Shutdown:
    """One shutdown, requested at most once until `clear`.

    Attributes:
        runs: Present runs, such as those of state machines; their `stop` is called in a thread of
            their clock when shutdown is requested. A run adds itself and then checks `requested`,
            as the request may have come before. A plain set, so that it needs no lock.

    Threads: every method may be called from any thread; `note` from a signal handler too.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._reason: str | None = None
        self._delivered = False
        self._events: weakref.WeakKeyDictionary[Clock, Event] = weakref.WeakKeyDictionary()
        self._callbacks: dict[int, tuple[Clock, Callable[[], object]]] = {}
        self._count = 0
        self.runs: set[Stoppable] = set()
        self._at_exit: dict[int, Callable[[], object]] = {}

    @property
    def reason(self) -> str | None:
        """Why it was requested; None when it was not."""
        return self._reason

    def requested(self) -> bool:
        """Return whether shutdown was requested."""
        return self._reason is not None

    def event(self, clock: Clock | None = None) -> Event:
        """Return the event of `clock` that is set by the request.

        There is one event per clock; only this object may set or clear it.
        """
        clock = current_clock() if clock is None else clock
        with self._lock:
            event = self._events.get(clock)
            if event is None:
                event = self._events[clock] = clock.event()
                if self._reason is not None:
                    event.set()
            return event

    def on_shutdown(self, callback: Callable[[], object]) -> Callable[[], None]:
        """Call `callback` once when shutdown is requested; at once if it already was.

        Returns:
            A function that unregisters the callback.

        Threads: the callback runs in a thread of the current clock, never in a signal handler; it
            may block. An exception is passed to `threading.excepthook`.
        """
        clock = current_clock()
        with self._lock:
            late = self._delivered
            self._count += 1
            number = self._count
            if not late:
                self._callbacks[number] = clock, callback
        if late:
            SerialExecutor(clock, "shutdown").submit(callback)

        def forget() -> None:
            with self._lock:
                self._callbacks.pop(number, None)

        return forget

    def at_exit(self, callback: Callable[[], object]) -> Callable[[], None]:
        """Call `callback` when the interpreter exits, before the default node leaves the network.

        Returns:
            A function that unregisters the callback.

        Threads: the callback runs in the main thread and may block. Other threads still run, and
            the current clock keeps `EXIT_THREADS` for new tasks, as Python 3.12 can no longer start
            threads. An exception is passed to `threading.excepthook`.
        """
        clock = current_clock()
        if isinstance(clock, RealClock):
            clock.keep_threads(EXIT_THREADS)
        with self._lock:
            if not self._at_exit:
                atexit.register(self.leave)
            self._count += 1
            number = self._count
            self._at_exit[number] = callback

        def forget() -> None:
            with self._lock:
                self._at_exit.pop(number, None)

        return forget

    def leave(self) -> None:
        """Call the callbacks of `at_exit` once, the newest first."""
        with self._lock:
            callbacks = [self._at_exit[number] for number in sorted(self._at_exit, reverse=True)]
            self._at_exit.clear()
        for callback in callbacks:
            try:
                callback()
            except Exception:  # noqa: BLE001  user code: reported, the others are called too
                report_thread_exception()

    def request(self, reason: str = "requested") -> bool:
        """Request the shutdown.

        Returns:
            Whether this was the first request.
        """
        with self._lock:
            # Decided by `_delivered`: a signal handler has already set the reason (`note`).
            first = not self._delivered
            self.note(reason)
            self._delivered = True
            events = list(self._events.values()) if first else []
            callbacks = list(self._callbacks.values()) if first else []
            callbacks += [(run.clock, run.stop) for run in self.runs.copy()] if first else []
            self._callbacks.clear()
        # Without the lock, which callbacks may need.
        for event in events:
            event.set()
        for clock, callback in callbacks:
            SerialExecutor(clock, "shutdown").submit(callback)
        return first

    def note(self, reason: str) -> None:
        """Make `requested` true without waking any thread; takes no lock, for signal handlers."""
        if self._reason is None:
            self._reason = reason

    def clear(self) -> None:
        """Withdraw the request, for a program that continues."""
        with self._lock:
            self._reason = None
            self._delivered = False
            for event in self._events.values():
                event.clear()


class _SignalHandler:
    """Turns signals into a request.

    The handler itself takes no lock, since the interrupted code may hold it. A thread that waits
    for the handler makes the request.
    """

    def __init__(self, shutdown: Shutdown, signals: Iterable[signal.Signals]) -> None:
        self._shutdown = shutdown
        self._before = {number: signal.getsignal(number) for number in signals}
        self._clock = RealClock()
        self._wake = self._clock.event()
        self._over = False
        self.task = self._clock.spawn(self._relay, name="shutdown-signals")

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        # `_wake` also distinguishes the first signal from later ones. With the default handler,
        # restored below, a second SIGTERM and a third SIGINT end the process.
        if not self._wake.is_set():
            self._shutdown.note(signal.Signals(number).name)
            self._wake.set()
        elif number == signal.SIGINT:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            raise KeyboardInterrupt
        else:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    def _relay(self) -> None:
        self._wake.wait()
        if not self._over:
            self._shutdown.request(self._shutdown.reason or "signal")

    def begin(self) -> None:
        """Handle the signals."""
        _handlers.append(self)
        for number in self._before:
            signal.signal(number, self)

    def restore(self) -> None:
        """Return the signals to their handlers of before."""
        _handlers.remove(self)
        # None: the old handler was not installed from Python, and cannot be restored.
        for number, old in self._before.items():
            signal.signal(number, signal.SIG_DFL if old is None else old)

    def end(self) -> None:
        """End the thread; a pending request is still made."""
        if not self._wake.is_set():
            self._over = True
            self._wake.set()


_handlers: list[_SignalHandler] = []


def _restore_in_child() -> None:
    """In a forked process, return the signals to the handlers of before.

    The thread that makes the request exists only in the parent: a signal would do nothing here, and
    `multiprocessing.Process.terminate` not end a worker.
    """
    for handler in reversed(_handlers.copy()):  # nested ones: the oldest handlers are set last
        handler.restore()


restorers: list[Callable[[], None]] = [_restore_in_child]
"""Called in a forked process, to return its signals to the handlers of before."""
_masks: dict[int, set[int]] = {}  # of the threads that fork just now


def _before_fork() -> None:
    # A signal that reaches the new process before its handlers are restored would be lost: CPython
    # drops what is pending after a fork. Blocked, it waits for `_after_fork_in_child`.
    blocked = (signal.SIGINT, signal.SIGTERM)
    _masks[threading.get_ident()] = signal.pthread_sigmask(signal.SIG_BLOCK, blocked)


def _after_fork() -> None:
    mask = _masks.pop(threading.get_ident(), None)
    if mask is not None:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _after_fork_in_child() -> None:
    try:
        for restore in restorers:
            restore()
    finally:
        _after_fork()  # or the process could not be ended by a signal


if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_before_fork,
        after_in_parent=_after_fork,
        after_in_child=_after_fork_in_child,
    )

_process = Shutdown()
_current: ContextVar[Shutdown] = ContextVar("shutdown", default=_process)


def current_shutdown() -> Shutdown:
    """Return the current shutdown: that of `use_shutdown`, or else the process's."""
    return _current.get()


@contextlib.contextmanager
def use_shutdown(shutdown: Shutdown) -> Iterator[Shutdown]:
    """Make `shutdown` the current one inside the `with` block, also for tasks spawned in it."""
    token = _current.set(shutdown)
    try:
        yield shutdown
    finally:
        _current.reset(token)


def requested() -> bool:
    """Return whether shutdown was requested."""
    return current_shutdown().requested()


def event(clock: Clock | None = None) -> Event:
    """Return the event that is set by the request; see `Shutdown.event`."""
    return current_shutdown().event(clock)


def request(reason: str = "requested") -> bool:
    """Request the shutdown; see `Shutdown.request`."""
    return current_shutdown().request(reason)


def on_shutdown(callback: Callable[[], object]) -> Callable[[], None]:
    """Call `callback` when shutdown is requested; see `Shutdown.on_shutdown`."""
    return current_shutdown().on_shutdown(callback)


@contextlib.contextmanager
def handle_signals(
    signals: tuple[signal.Signals, ...] = (signal.SIGINT, signal.SIGTERM),
) -> Iterator[Shutdown]:
    """Turn signals into a request inside the `with` block; the old handlers return after it.

    Raises:
        RuntimeError: this is not the main thread, the only one that may handle signals.
    """
    if threading.current_thread() is not threading.main_thread():
        raise RuntimeError(
            f"shutdown: signals cannot be handled here: got thread "
            f"{threading.current_thread().name!r}; expected the main thread. Try calling "
            "handle_signals before starting threads."
        )
    shutdown = current_shutdown()
    handler = _SignalHandler(shutdown, signals)
    try:
        handler.begin()
        yield shutdown
    finally:
        if handler in _handlers:  # else a forked process has left the block
            handler.restore()
        handler.end()
