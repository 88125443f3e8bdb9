"""Run callables one after another, off the calling thread, without a thread while idle."""

from __future__ import annotations

import _thread
import threading
from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock._protocol import Clock, Task


class SerialExecutor:
    """Runs submitted callables in order, one at a time, in a task that ends when idle.

    User callbacks go through one of these, so that they may block without holding up the
    transport, and callbacks of one owner never overlap. An exception is reported, and so is what
    ends a thread (`sys.exit`, for one); what was submitted after it runs all the same.

    Args:
        clock: Gives events, and the task.
        name: The task's.
        spawn: Starts the task in another way than `clock.spawn` does.

    Threads: `submit` may be called from any thread or signal handler and never waits.
    """

    def __init__(self, clock: Clock, name: str, spawn: Callable[..., Task] | None = None) -> None:
        self._clock = clock
        self._name = name
        self._spawn = spawn or clock.spawn
        self._queue: deque[Callable[[], object]] = deque()
        # Held while a task runs what is queued. Nobody waits for it: a signal handler that submits
        # may have interrupted a `submit` of the same thread at any line.
        self._busy = _thread.allocate_lock()

    def submit(self, function: Callable[[], object]) -> None:
        """Run `function` after everything submitted before it."""
        self._queue.append(function)
        self._start()

    def join(self, timeout: float | None = None) -> bool:
        """Wait until everything submitted before has run.

        Returns:
            Whether it has.

        Blocks: until then or `timeout` [s] has passed. Not to be called from a submitted callable.
        """
        # In this order: what is taken from the queue runs while `_busy` is held.
        if not self._queue and not self._busy.locked():
            return True
        reached = self._clock.event()
        self.submit(reached.set)
        return reached.wait(timeout)

    def _start(self) -> None:
        if self._queue and self._busy.acquire(blocking=False):
            try:
                self._spawn(self._drain, name=self._name)
            except BaseException:  # the system gives no thread
                self._busy.release()
                raise

    def _drain(self) -> None:
        try:
            while self._queue:
                try:
                    self._queue.popleft()()
                except Exception:  # noqa: BLE001  a border: reported, the next callable still runs
                    report_thread_exception()
        except SystemExit as error:  # the one that a thread ends with in silence
            report_exit(self._name, error)
            raise
        finally:
            self._busy.release()
            self._start()  # what was submitted until here has found it busy


def report_exit(name: str, error: SystemExit) -> None:
    """Log that a callback has called `sys.exit`, of which `threading.excepthook` says nothing."""
    import logging  # 4 ms that a state machine alone never needs

    log = logging.getLogger(__name__)
    log.error("%s: a callback raised SystemExit: %s", name, error, exc_info=error)


def report_thread_exception() -> None:
    """Give the exception being handled to `threading.excepthook`, as an ending thread would."""
    import sys

    kind, value, traceback = sys.exc_info()
    if kind is None or value is None:
        return
    try:
        threading.excepthook(
            threading.ExceptHookArgs((kind, value, traceback, threading.current_thread()))
        )
    except BaseException as error:  # noqa: BLE001  the program's own hook: it must not end us
        sys.__excepthook__(kind, value, traceback)
        sys.__excepthook__(type(error), error, error.__traceback__)


def report_callback(name: str) -> None:
    """Report the exception being handled, which a callback has raised; lets nothing through."""
    import sys

    error = sys.exc_info()[1]
    if not isinstance(error, SystemExit):
        report_thread_exception()
        return
    try:
        report_exit(name, error)
    except BaseException:  # noqa: BLE001  a handler of the program's log
        report_thread_exception()
