"""The shutdown of the program as one event: requested by a signal, by the program, or by a test.

    with shutdown.handle_signals():
        shutdown.on_shutdown(machine.request_preempt)
        machine.execute()

The first of `SIGNALS` requests the shutdown. A second SIGINT raises KeyboardInterrupt, as by
default in Python; any other later one ends the process, whose machines first cancel their goals.

Tests use a `Shutdown` of their own (`use_shutdown`) and request it by hand.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without enums: faster, for each run
import _thread
import atexit
import contextlib
import os
import signal
import sys
import threading
import weakref
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Final, Protocol

from actionlib_core.clock import RealClock, SerialExecutor, current_clock
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.process.output import leave_closed_terminals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from types import FrameType
    from typing import NoReturn, Self

    from actionlib_core.clock import Clock, Event

EXIT_THREADS = 4  # for timers, callbacks, and two for a machine that is preempted
LEAVE_S: Final = 2.0
"""Longest wait of the interpreter's exit for machines that still run in other threads [s]."""
LAST_S: Final = 0.2
"""Time for the last cancels to leave this process before it ends [s]."""
ECHO_S: Final = 0.5
"""A signal this soon after another one, of which one is SIGHUP, is no second request [s]."""

_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT")
SIGNALS: Final = tuple(signal.Signals[name] for name in _NAMES if hasattr(signal, name))
"""Ask a program to end: Ctrl-C, the stop of a service, a closed terminal, Ctrl-Backslash."""


AT_EXIT: Final = "exit"
"""The reason when the interpreter exits while machines run in other threads."""
EXIT_SIGNAL: Final = 128
"""Exit code of a program that a signal has ended, less the signal's number, as in shells."""


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
        runs: Present runs, such as those of state machines; the request calls their `stop` in
            another thread. A run calls `enlist` at its begin and `forget` at its end.
        cancels: Called when the process is about to end although runs go on, because of a second
            signal or the program's end: each cancels a goal that nobody would follow any more, and
            does not block.
        is_last: They have been called, or are just now: what is added from now on is not.

    Threads: every method may be called from any thread; `note` from a signal handler too.
    """

    def __init__(self) -> None:
        self._reason: str | None = None
        self._delivered = False
        self._events: weakref.WeakKeyDictionary[Clock, Event] = weakref.WeakKeyDictionary()
        self.begin()
        _all.add(self)

    def begin(self) -> None:
        """Begin without runs and callbacks; in a forked process again: they are its parent's."""
        self._lock = threading.Lock()
        self._callbacks: dict[int, tuple[Clock, Callable[[], object]]] = {}
        self._count = 0
        self.runs: set[Stoppable] = set()
        self.cancels: set[Callable[[], object]] = set()
        self.is_last = False
        self._at_exit: dict[int, Callable[[], object]] = {}
        self._nothing_runs: Event | None = None  # only while `leave` waits

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

    def enlist(self, run: Stoppable) -> list[Stoppable]:
        """Add a run that begins, and return the others.

        A request stops it from here on. If `requested` is true already, it stops itself.
        """
        with self._lock:
            others = list(self.runs)
            self.runs.add(run)
            return others

    def forget(self, run: Stoppable) -> None:
        """Remove a run that has ended."""
        with self._lock:
            self.runs.discard(run)
            waiting = None if self.runs else self._nothing_runs
        if waiting is not None:
            waiting.set()

    def leave(self) -> None:
        """Call the callbacks of `at_exit` once, the newest first, and end the runs that are left.

        Called at the interpreter's exit. The runs are in threads that end with the process, and
        their robots would drive on.

        Blocks: as the callbacks do, and `LEAVE_S` for the runs.
        """
        with self._lock:
            callbacks = [self._at_exit[number] for number in sorted(self._at_exit, reverse=True)]
            self._at_exit.clear()
        # In this thread: Python 3.12 starts no others at this time.
        with self._lock:
            all_runs = self.runs.copy()
        runs = [run for run in all_runs if isinstance(run.clock, RealClock)]
        if runs and not callbacks:
            self.note(AT_EXIT)
        for call in (*callbacks, *(run.stop for run in runs)):
            try:
                call()
            except Exception:  # noqa: BLE001  user code: reported, the others are called too
                report_thread_exception()
        if runs:
            nothing_runs = RealClock().event("the end of all runs")
            with self._lock:
                self._nothing_runs = nothing_runs if self.runs else None
            if self._nothing_runs is not None:
                nothing_runs.wait(LEAVE_S)
            self.cancel_all()

    def cancel_all(self) -> None:
        """Call the `cancels`, and give them time to leave this process.

        Blocks: for `LAST_S` if there are any.
        """
        self.is_last = True  # first: a goal that begins now is in the set, or cancels itself
        cancels, self.cancels = self.cancels, set()
        for cancel in tuple(cancels):  # a thread that has read the old set may still add to it
            try:
                cancel()
            except Exception:  # noqa: BLE001  reported; the others are called too
                report_thread_exception()
        if cancels:
            RealClock().sleep(LAST_S)

    def exit_by(self, name: str) -> NoReturn:
        """End this process because of the signal `name`, in good order but for other threads.

        Threads: any.
        """
        self.cancel_all()
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):  # a stream of the user's, or none
                stream.flush()
        os._exit(EXIT_SIGNAL + signal.Signals[name])

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
            callbacks += [(_from_outside(run.clock), run.stop) for run in self.runs.copy() if first]
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
            self._delivered = self.is_last = False
            for event in self._events.values():
                event.clear()


def _from_outside(clock: Clock) -> Clock:
    """Return the clock in whose thread a run is stopped: its own, or a real one for a signal.

    A thread of a virtual clock begins when the others wait, which a busy program never does.
    """
    is_participant: Any = getattr(clock, "is_participant", None)
    inside = is_participant is None or is_participant(threading.get_ident())
    return clock if inside else RealClock()


# -- signals -------------------------------------------------------------------------------------

# What a program has that sets no handler of its own.
_DEFAULTS: Final = tuple(
    (int(number), signal.default_int_handler if number == signal.SIGINT else _signal.SIG_DFL)
    for number in SIGNALS
)
# A parent that waits with `sigwait` hands its mask down, and nothing but SIGKILL would end the
# program. SIGURG interrupts a state that ignores its preempt (`smachpy.engine.interrupt`).
_UNBLOCKED: Final = (*(int(number) for number in SIGNALS), int(signal.SIGURG))


def default_signals() -> tuple[signal.Signals, ...]:
    """Return those of `SIGNALS` that the program neither handles nor ignores."""
    return tuple(signal.Signals(n) for n, default in _DEFAULTS if _signal.getsignal(n) is default)


class SignalHandler:
    """Turns signals into a request, inside a `with` block in the main thread.

    Meanwhile they are not blocked, whatever mask the process has inherited.

    Args:
        shutdown: What is requested.
        signals: These; None: those of `SIGNALS` that have their default handler.
        interrupted: In an interactive session, called on Ctrl-C instead of the request, which would
            stop all that is executed later; None: requests in any case.

    Threads: the handler itself takes no lock, since the interrupted code may hold it: it starts a
        thread, which makes the request.
    """

    __slots__ = (
        "_before",
        "_blocked",
        "_first",
        "_first_at",
        "_has_raised",
        "_interrupted",
        "_shutdown",
        "_signals",
    )

    def __init__(
        self,
        shutdown: Shutdown,
        signals: Iterable[int] | None = None,
        interrupted: Callable[[], object] | None = None,
    ) -> None:
        self._shutdown = shutdown
        self._signals = signals
        self._interrupted = interrupted
        self._first = 0
        self._first_at: float | None = None
        self._has_raised = False
        self._before: list[tuple[int, Any]] = []
        self._blocked: set[int] = set()

    def __enter__(self) -> Self:
        _handlers.append(self)
        get, set_ = _signal.getsignal, _signal.signal
        if self._signals is None:
            for number, default in _DEFAULTS:
                if get(number) is default:
                    self._before.append((number, default))
                    set_(number, self)
        else:
            for number in self._signals:
                self._before.append((number, get(number)))
                set_(number, self)
        if _signal.pthread_sigmask(_signal.SIG_UNBLOCK, ()):
            self._blocked = _signal.pthread_sigmask(_signal.SIG_UNBLOCK, _UNBLOCKED)
        return self

    def __exit__(self, *_: object) -> None:
        if self in _handlers:  # else a forked process has left the block
            self.restore()

    def restore(self) -> None:
        """Return the signals to their handlers of before."""
        _handlers.remove(self)
        for number, old in self._before:
            # Of those that the program had not set, one that it has set meanwhile is kept.
            if self._signals is not None or _signal.getsignal(number) is self:
                # None: the old handler was not installed from Python, and cannot be restored.
                _signal.signal(number, _signal.SIG_DFL if old is None else old)
        if again := self._blocked.intersection(_UNBLOCKED):
            _signal.pthread_sigmask(_signal.SIG_BLOCK, again)

    def __call__(self, number: int, _frame: FrameType | None) -> None:
        """Handle a signal."""
        now = RealClock.now()
        hangup = getattr(signal, "SIGHUP", 0)
        is_closed = number == hangup and leave_closed_terminals()
        if self._first_at is None:
            self._first, self._first_at = number, now
            alone = self._interrupted if number == signal.SIGINT and _is_interactive() else None
            if alone is None:
                self._shutdown.note(signal.Signals(number).name)
            self._start(alone or self._request)
        elif number == signal.SIGINT and not self._has_raised:
            self._has_raised = True
            raise KeyboardInterrupt
        elif not is_closed and (
            hangup not in {number, self._first} or now - self._first_at >= ECHO_S
        ):
            # Not for the echo of another signal. When a terminal is closed, its shell sends SIGHUP,
            # and the system once more; some services are stopped by SIGTERM and SIGHUP together,
            # of which Python handles SIGHUP first.
            self._end(number)

    def _start(self, function: Callable[[], object]) -> None:
        """Call `function` in a new thread.

        Not one of `threading` or a clock: the interrupted code may hold their locks.
        """
        try:
            _thread.start_new_thread(_reported, (function,))
        except RuntimeError:  # the system has no more threads: as the second Ctrl-C
            raise KeyboardInterrupt from None

    def _request(self) -> None:
        self._shutdown.request(self._shutdown.reason or "signal")

    def _end(self, number: int) -> None:
        """End the process; first cancel the goals of machines that still run."""
        _signal.signal(number, _signal.SIG_DFL)  # one more ends it at once
        if not self._shutdown.cancels:
            _end_process(number)

        def cancel_and_end() -> None:
            self._shutdown.cancel_all()
            _end_process(number)

        self._start(cancel_and_end)


def _end_process(number: int) -> NoReturn:
    """End this process at once by the signal `number`, whose handler was removed."""
    os.kill(os.getpid(), number)
    # For process 1 of a container the system ignores signals without a handler.
    os._exit(EXIT_SIGNAL + number)


def _is_interactive() -> bool:
    """Return whether a person types the program line by line, as in a notebook."""
    return hasattr(sys, "ps1") or bool(sys.flags.interactive)


def _reported(function: Callable[[], object]) -> None:
    try:
        function()
    except BaseException:  # noqa: BLE001  the end of this thread: reported
        report_thread_exception()


_handlers: list[SignalHandler] = []


def _restore_in_child() -> None:
    """In a forked process, return the signals to the handlers of before.

    What would be stopped runs only in the parent: a signal would do nothing here, and
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
    _masks[threading.get_ident()] = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)


def _after_fork() -> None:
    mask = _masks.pop(threading.get_ident(), None)
    if mask is not None:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _after_fork_in_child() -> None:
    try:
        for shutdown in list(_all):
            shutdown.begin()
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

_all: weakref.WeakSet[Shutdown] = weakref.WeakSet()
_process = Shutdown()
atexit.register(_process.leave)
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
def handle_signals(signals: Iterable[signal.Signals] = SIGNALS) -> Iterator[Shutdown]:
    """Turn signals into a request inside the `with` block; the old handlers return after it.

    SIGHUP and SIGQUIT stay ignored if the process was started so, as by `nohup`.

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
    wanted = (signal.SIGINT, signal.SIGTERM)  # even if ignored: a shell's background job is
    taken = [n for n in signals if n in wanted or signal.getsignal(n) is not signal.SIG_IGN]
    with SignalHandler(shutdown, taken):
        yield shutdown


class Terminated(KeyboardInterrupt):
    """A signal that ends programs has come; commands react as to Ctrl-C.

    Attributes:
        number: The signal.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        super().__init__(signal.Signals(number).name)


@contextlib.contextmanager
def terminable(signals: Iterable[int] | None = None) -> Iterator[None]:
    """Raise `Terminated` on the signals that end a program by default, inside the `with` block.

    They would end Python at once, without any `finally` of the command. Ctrl-C raises
    KeyboardInterrupt anyway. `signals` are others to raise it on, as those of `handle_signals`
    before there is anything to stop; ignored ones stay so. A signal within `ECHO_S` of the first is
    its echo, as when a terminal is closed: it would end what the first has begun. In a thread that
    may not handle signals nothing is done.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    first_at: float | None = None

    def on_signal(number: int, _frame: object) -> None:
        nonlocal first_at
        leave_closed_terminals()
        now = RealClock.now()
        if first_at is None:
            first_at = now
        elif now - first_at < ECHO_S:
            return
        raise Terminated(number)

    if signals is None:
        signals = [number for number in default_signals() if number != signal.SIGINT]
    handlers = ((number, signal.getsignal(number)) for number in signals)
    before = {number: handler for number, handler in handlers if handler is not signal.SIG_IGN}

    def restore() -> None:
        for number, handler in before.items():
            if signal.getsignal(number) is on_signal:
                signal.signal(number, handler)

    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    try:
        restorers.append(restore)
        for number in before:
            signal.signal(number, on_signal)
        yield
    finally:
        restore()
        restorers.remove(restore)


@contextlib.contextmanager
def exits_on_signals() -> Iterator[None]:
    """Leave the program by `SystemExit` on the signals that end it by default, in a `with` block.

    By default they end Python at once, without `finally` and `atexit`: servers would not stop what
    their goals have started. A second signal ends it at once, but not SIGHUP: that comes twice when
    a terminal is closed, or with SIGTERM. The exit code is that of commands.
    """
    taken = set(default_signals()) - {signal.SIGINT}
    if not taken:  # another one handles them
        yield
        return
    try:
        with terminable():
            try:
                yield
            except Terminated:  # in here: the echo may come at once
                if signal.SIGHUP in taken:
                    signal.signal(signal.SIGHUP, signal.SIG_IGN)
                raise
    except Terminated as error:
        raise SystemExit(EXIT_SIGNAL + error.number) from None
