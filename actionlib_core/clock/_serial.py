"""Run callables one after another, off the calling thread, without a thread while idle."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock._protocol import Task


class Spawner(Protocol):
    """What starts a task: a clock, or something in front of one."""

    def spawn(self, target: Callable[[], object], *, name: str) -> Task:
        """Run `target` in a thread of its own."""
        ...


class SerialExecutor:
    """Runs submitted callables in order, one at a time, in a task that ends when idle.

    User callbacks go through one of these, so that they may block without holding up the
    transport, and callbacks of one owner never overlap. An exception is reported, and so is what
    ends a thread (`sys.exit`, for one); what was submitted after it runs all the same.

    Threads: `submit` may be called from any thread and never waits for a callable.
    """

    def __init__(self, clock: Spawner, name: str) -> None:
        self._clock = clock
        self._name = name
        self._lock = threading.Lock()
        self._queue: deque[Callable[[], object]] = deque()
        self._task: Task | None = None

    def submit(self, function: Callable[[], object]) -> None:
        """Run `function` after everything submitted before it."""
        with self._lock:
            self._queue.append(function)
            if self._task is None:
                self._task = self._clock.spawn(self._drain, name=self._name)

    def join(self, timeout: float | None = None) -> bool:
        """Wait until nothing is queued or running.

        Returns:
            Whether the executor became idle.

        Blocks: until idle or `timeout` [s] has passed. Not to be called from a submitted callable.
        """
        while True:
            with self._lock:
                task = self._task
            if task is None:
                return True
            if not task.join(timeout):
                return False
            if task.error is None:  # else another task goes on with the rest
                return True

    def _drain(self) -> None:
        try:
            self._run_all()
        except BaseException as error:
            if isinstance(error, SystemExit):  # the one that a thread ends with in silence
                report_exit(self._name, error)
            with self._lock:
                self._task = None
                if self._queue:
                    self._task = self._clock.spawn(self._drain, name=self._name)
            raise

    def _run_all(self) -> None:
        while True:
            with self._lock:
                if not self._queue:
                    self._task = None
                    return
                function = self._queue.popleft()
            try:
                function()
            except Exception:  # noqa: BLE001  a border: reported, and the next callable still runs
                report_thread_exception()


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
