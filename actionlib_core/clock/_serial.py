"""A queue of callables that run one after another in another thread; no thread while idle."""

from __future__ import annotations

import _thread
import os
import threading
from collections import deque
from typing import TYPE_CHECKING

from actionlib_core.clock.forks import is_copy

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock._protocol import Clock, Task

LATE_S = 0.1  # when the system has no thread left, one is tried again after this time


class SerialExecutor:
    """Runs submitted callables in order, one at a time, in a task that ends when idle.

    User callbacks run in one of these, so that they may block without delaying the transport, and
    callbacks of one owner never overlap. Exceptions are reported, also those that end a thread,
    such as `sys.exit`; later callables run all the same.

    Args:
        clock: Makes events and tasks.
        name: The task's name.
        spawn: Starts the task; None: `clock.spawn`.

    Threads: `submit` may be called from any thread or signal handler and never blocks.
    """

    def __init__(self, clock: Clock, name: str, spawn: Callable[..., Task] | None = None) -> None:
        self._clock = clock
        self._name = name
        self._spawn = spawn or clock.spawn
        self._queue: deque[Callable[[], object]] = deque()
        # Held while a task runs the queue. It is never waited for: a signal handler that submits
        # may have interrupted a `submit` of the same thread at any line.
        self._busy = _thread.allocate_lock()
        self._is_late = False  # a timer tries again to start a task
        self._pid = os.getpid()

    def submit(self, function: Callable[[], object]) -> None:
        """Run `function` after everything submitted before it; in a forked process do nothing.

        If no thread can be started it runs later.

        Raises:
            RuntimeError: there is no thread for the clock's timers either, or the interpreter is
                exiting: it runs after the next call, if there is one.
        """
        if is_copy(self._pid):
            return
        self._queue.append(function)
        self._start()

    def join(self, timeout: float | None = None) -> bool:
        """Wait until everything submitted before has run.

        Returns:
            Whether it has.

        Blocks: until then or `timeout` [s] has passed. Not to be called from a submitted callable.
        """
        # In this order: a callable that has left the queue runs while `_busy` is held.
        if is_copy(self._pid) or (not self._queue and not self._busy.locked()):
            return True
        reached = self._clock.event()
        self.submit(reached.set)
        return reached.wait(timeout)

    def _start(self) -> None:
        if self._queue and self._busy.acquire(blocking=False):
            try:
                self._spawn(self._drain, name=self._name)
            except BaseException as error:
                self._busy.release()
                if not isinstance(error, RuntimeError) or not threading.main_thread().is_alive():
                    raise
                self._start_late()

    def _start_late(self) -> None:
        """Try again later: what waits here may be the last for long."""
        if not self._is_late:
            self._is_late = True
            try:
                self._clock.call_later(LATE_S, self._start_again)
            except BaseException:
                self._is_late = False
                raise

    def _start_again(self) -> None:
        self._is_late = False
        self._start()

    def _drain(self) -> None:
        try:
            while self._queue:
                try:
                    self._queue.popleft()()
                except Exception:  # noqa: BLE001  reported here; the next callable still runs
                    report_thread_exception()
        except SystemExit as error:  # threads end silently with this one
            report_exit(self._name, error)
            raise
        finally:
            self._busy.release()
            # A callable submitted since the last check of the queue has found `_busy` held.
            self._start()


def report_exit(name: str, error: SystemExit) -> None:
    """Log that a callback has called `sys.exit`, which `threading.excepthook` ignores."""
    import logging  # here: it takes 4 ms, and programs with state machines only never need it

    log = logging.getLogger(__name__)
    log.error("%s: a callback raised SystemExit: %s", name, error, exc_info=error)


def report_thread_exception() -> None:
    """Pass the current exception to `threading.excepthook`, as at the end of a thread."""
    import sys

    kind, value, traceback = sys.exc_info()
    if kind is None or value is None:
        return
    try:
        threading.excepthook(
            threading.ExceptHookArgs((kind, value, traceback, threading.current_thread()))
        )
    except BaseException as error:  # noqa: BLE001  of the program's own hook: report both
        sys.__excepthook__(kind, value, traceback)
        sys.__excepthook__(type(error), error, error.__traceback__)


def report_callback(name: str) -> None:
    """Report the current exception, raised by a callback; never raises."""
    import sys

    error = sys.exc_info()[1]
    if not isinstance(error, SystemExit):
        report_thread_exception()
        return
    try:
        report_exit(name, error)
    except BaseException:  # noqa: BLE001  of a log handler of the program
        report_thread_exception()
