"""The queue in which user callbacks run: in order, and not on the network's thread."""

from __future__ import annotations

import contextlib
import contextvars
import threading
from collections import deque
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING

from actionlib_core.clock import SerialExecutor, use_clock
from actionlib_core.clock._serial import LATE_S, report_thread_exception
from actionlib_core.node import use_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Task, Timer
    from actionlib_core.node import Node


PATIENCE_S = 0.02  # an urgent callback waits this long for those queued before it
HELPERS = 8  # most threads for urgent callbacks, when none of the others returns


class CallbackQueue:
    """Runs the callbacks of one client or server one at a time, in the order of the calls.

    They run with the owner's clock and node as the current ones. No thread exists while idle.
    Urgent callbacks (a cancel) run beside others that take longer than `PATIENCE_S`, in another
    thread: the callback that blocks is often the one that the cancel is to end.

    Attributes:
        context: The context of the callbacks. Run a copy: one context cannot be entered twice.

    Threads: any; `call` never blocks, so it may be used under a lock.
    """

    def __init__(self, node: Node, name: str) -> None:
        with use_clock(node.clock), use_node(node):
            self.context = contextvars.copy_context()
        self._clock = node.clock
        self._name = name
        self._executor = SerialExecutor(node.clock, name, self._spawn_marked)
        self._thread: int | None = None  # id of the thread that runs callbacks now
        self._lock = threading.Lock()  # guards the next two
        self._urgent: deque[_Once] = deque()
        self._helpers = 0

    def call(self, function: Callable[..., object], *args: object) -> None:
        """Run `function(*args)` after everything queued before."""
        self._executor.submit(partial(function, *args) if args else function)

    def call_urgently(self, function: Callable[..., object], *args: object) -> None:
        """Call a callback in its turn; if others delay it, beside them in another thread."""
        once = _Once(partial(function, *args))
        # Both the timer and the queue get it; the first of them runs it.
        with contextlib.suppress(RuntimeError):  # no thread for timers is left: it waits
            once.timer = self._clock.call_later(PATIENCE_S, partial(self._overtake, once))
        self._executor.submit(once)

    def _overtake(self, once: _Once) -> None:
        with self._lock:
            self._urgent.append(once)
        self._start_helper()

    def _start_helper(self) -> None:
        with self._lock:
            if not self._urgent or self._helpers >= HELPERS:
                return
            self._helpers += 1
        try:
            self.spawn(self._help, self._name)
        except BaseException as error:
            with self._lock:
                self._helpers -= 1
            if not isinstance(error, RuntimeError):
                raise
            self._clock.call_later(LATE_S, self._start_helper)  # the system has no thread left

    def _help(self) -> None:
        while True:
            with self._lock:
                if not self._urgent:
                    self._helpers -= 1  # under the lock: the next callback gets a new thread
                    return
                once = self._urgent.popleft()
            try:
                once()
            except Exception:  # noqa: BLE001  user code: reported, the next one still runs
                report_thread_exception()
            except BaseException:  # `sys.exit`, which ends this thread
                with self._lock:
                    self._helpers -= 1
                raise

    def spawn(self, target: Callable[[], object], name: str) -> Task:
        """Run `target` in a thread of its own, with the owner's clock and node."""
        return self.context.copy().run(partial(self._clock.spawn, target, name=name))

    def is_inside(self) -> bool:
        """Return whether the calling thread is running one of the queued callbacks."""
        return self._thread == get_ident()

    def _spawn_marked(self, target: Callable[[], object], name: str) -> Task:
        return self.spawn(partial(self._mark, target), name)

    def _mark(self, target: Callable[[], object]) -> None:
        """Run `target`, with this thread noted as the one that runs callbacks."""
        me = self._thread = get_ident()
        try:
            target()
        finally:
            if self._thread == me:  # else the next thread has already started
                self._thread = None


class _Once:
    """Runs a function once, in the first thread that calls it."""

    __slots__ = ("_functions", "timer")

    def __init__(self, function: Callable[[], object]) -> None:
        self._functions = [function]
        self.timer: Timer | None = None

    def __call__(self) -> None:
        try:
            function = self._functions.pop()  # atomic: one thread gets it
        except IndexError:  # another thread has taken it
            return
        if self.timer is not None:
            self.timer.cancel()
        function()
