"""How foreign threads deliver to callbacks: in order, never on a caller's own stack, stoppable.

A network library may call back on its own threads and also inside a call of ours. `Inlet` evens
that out; `Gate` lets a session end with no callback left running.
"""

from __future__ import annotations

import threading
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock import RealClock
from actionlib_core.clock._serial import report_thread_exception

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import SerialExecutor

T = TypeVar("T")


class Inside(threading.local):
    """How deep this thread is in calls into the library; a callback that finds it > 0 is inline."""

    depth = 0

    def __enter__(self) -> None:
        self.depth += 1

    def __exit__(self, *_: object) -> None:
        self.depth -= 1


inside = Inside()


class Gate:
    """Lets callbacks run until it is shut, and knows when the last one has returned.

    Who enters puts itself down before it looks whether the gate is shut, and who shuts it does so
    before looking who is down; list operations are atomic, so no lock is needed.
    """

    def __init__(self) -> None:
        self._running: list[int] = []
        self._shut = False
        self._left = RealClock().event()

    def enter(self) -> bool:
        """Tell whether a callback may start; it then ends with `leave`."""
        me = threading.get_ident()
        self._running.append(me)
        if self._shut:
            self.leave()
            return False
        return True

    def leave(self) -> None:
        """Note the end of a callback."""
        self._running.remove(threading.get_ident())
        if self._shut:
            self._left.set()

    def shut(self) -> None:
        """Let no callback start from now on."""
        self._shut = True

    def wait_idle(self, timeout: float) -> None:
        """Wait until no callback runs, not counting one that this thread is in itself.

        Blocks: `timeout` [s] at most.
        """
        deadline = RealClock.now() + timeout
        me = threading.get_ident()
        while True:
            self._left.clear()
            left = deadline - RealClock.now()
            if left <= 0 or all(runner == me for runner in tuple(self._running)):
                return
            self._left.wait(left)


class Inlet:
    """Runs what the library delivers to one declaration: in order, never inside a call of ours.

    Args:
        gate: Decides whether a callback may still start.
        executor: Runs what arrives inside a call of ours.
    """

    __slots__ = ("_gate", "_lock", "_queued", "_submit", "closed")

    def __init__(self, gate: Gate, executor: SerialExecutor) -> None:
        self._gate = gate
        self._submit = executor.submit
        self._lock = threading.Lock()
        self._queued = 0
        self.closed = False

    def take(
        self,
        function: Callable[[T], object],
        item: T,
        refuse: Callable[[T], object] | None = None,
    ) -> None:
        """Run `function(item)`, or `refuse(item)` when this is closed."""
        if inside.depth or self._queued:
            with self._lock:
                self._queued += 1
            self._submit(partial(self._run_queued, function, item, refuse))
        else:
            self._run(function, item, refuse)

    def _run_queued(
        self, function: Callable[[T], object], item: T, refuse: Callable[[T], object] | None
    ) -> None:
        try:
            self._run(function, item, refuse)
        finally:
            with self._lock:
                self._queued -= 1

    def _run(
        self, function: Callable[[T], object], item: T, refuse: Callable[[T], object] | None
    ) -> None:
        if self.closed or not self._gate.enter():
            if refuse is not None:
                refuse(item)
            return
        try:
            function(item)
        except Exception:  # noqa: BLE001  a border: reported, the next item is delivered
            report_thread_exception()
        finally:
            self._gate.leave()
