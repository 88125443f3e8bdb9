"""Delivery from the threads of a network library to callbacks.

A network library calls back on its own threads, and also inside a call of ours. `Inlet` delivers in
order and never on the stack of a caller, who may hold locks. `CallbackGate` lets a session end with
no callback left running.
"""

from __future__ import annotations

import ctypes
import sys
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock import RealClock
from actionlib_core.clock._ending import ending
from actionlib_core.clock._serial import report_thread_exception
from actionlib_core.exceptions import TransportError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import SerialExecutor

T = TypeVar("T")

# `Inside.wait_idle` polls: it runs once per process, while calls are frequent and would all have to
# signal their end.
POLL_S = 1e-3


class Inside:
    """The threads that are in calls into the library; a callback on one of them is inline.

    A dictionary by thread, not a `threading.local`: to Python a thread of the library is a new one
    each time it calls back, and a `threading.local` would set up its values each time.

    Attributes:
        depths: Thread id -> number of nested calls; other threads have no entry.
        ended_by: The id of the thread that ends the interpreter: no other one may begin a call any
            more. 0 before.
    """

    def __init__(self) -> None:
        self.depths: dict[int, int] = {}
        self.ended_by = 0

    def __enter__(self) -> None:
        """Begin a call.

        Raises:
            TransportError: as `check_late`.
        """
        me = get_ident()
        depth = self.depths.get(me, 0)
        # Before the check: so either `end` sees this thread, or this thread sees the end.
        self.depths[me] = depth + 1
        if self.ended_by and not depth:
            try:
                self.check_late(me)
            except TransportError:
                del self.depths[me]
                raise

    def __exit__(self, *_: object) -> None:
        me = get_ident()
        depth = self.depths.pop(me) - 1
        if depth:
            self.depths[me] = depth

    def check_late(self, me: int) -> None:
        """Refuse a call of the thread `me` from which it might return after the interpreter's end.

        Raises:
            TransportError: another thread has called `end`.
        """
        if self.ended_by not in {0, me}:
            ending.slow_down()
            raise TransportError(
                "network: got a call as the interpreter exits; expected none. Try to end the "
                "thread, or to close its node, before the program ends."
            )

    def end(self, timeout: float) -> None:
        """Let no other thread begin a call, and wait until those have returned that have begun.

        Blocks: as `wait_idle`.
        """
        self.ended_by = get_ident()
        self.wait_idle(timeout)

    def wait_idle(self, timeout: float) -> None:
        """Wait until no other thread is in a call.

        Blocks: until `timeout` [s] have passed in which none of them has returned from its call.
        Time in which the process was suspended does not count, as the sleeps are counted and not
        the clock.
        """
        left = timeout
        others = self.depths.keys() - {get_ident()}
        while others and left > 0.0:
            RealClock().sleep(POLL_S)
            left -= POLL_S
            still = self.depths.keys() & others
            if len(still) < len(others):
                others, left = still, timeout


inside = Inside()


class CallbackGate:
    """Lets callbacks run until it is shut, and waits until the last one has returned.

    It needs no lock: a callback registers in `running` before it reads `is_shut`, and `shut` sets
    `is_shut` before `wait_idle` reads `running`. So one of the two sees the other. List operations
    are atomic.

    Attributes:
        running: The threads that are in a callback, or about to check whether they may start.
        is_shut: No callback may start.
        left: Set by each callback that returns after the gate was shut.
    """

    def __init__(self) -> None:
        self.running: list[int] = []
        self.is_shut = False
        self.left = RealClock().event()

    def shut(self) -> None:
        """Let no callback start from now on."""
        self.is_shut = True

    def wait_idle(self, timeout: float) -> None:
        """Wait until no callback runs, except one in this thread.

        Blocks: `timeout` [s] at most.
        """
        deadline = RealClock.now() + timeout
        me = get_ident()
        while True:
            self.left.clear()  # before reading `running`: a callback that returns then sets it
            left = deadline - RealClock.now()
            if left <= 0 or all(runner == me for runner in tuple(self.running)):
                return
            self.left.wait(left)


class Inlet:
    """Delivers the items of one declaration: in order, and never inside a call of ours.

    Args:
        gate: Whether a callback may still start.
        executor: Delivers the items that arrive inside a call of ours.
    """

    __slots__ = ("_gate", "_queued", "_submit", "closed")

    def __init__(self, gate: CallbackGate, executor: SerialExecutor) -> None:
        self._gate = gate
        self._submit = executor.submit
        self._queued: list[None] = []  # a counter of queued items: list operations are atomic
        self.closed = False

    def take(
        self,
        function: Callable[[T], object],
        item: T,
        refuse: Callable[[T], object] | None = None,
    ) -> None:
        """Run `function(item)`, or `refuse(item)` when this is closed."""
        me = get_ident()
        # While items are queued, the next ones must queue behind them to stay in order.
        if self._queued or me in inside.depths:
            self._queued.append(None)
            self._submit(partial(self._run_queued, function, item, refuse))
        else:
            if me not in pinned:
                pin(me)
            self._run(me, function, item, refuse)

    def _run_queued(
        self, function: Callable[[T], object], item: T, refuse: Callable[[T], object] | None
    ) -> None:
        try:
            self._run(get_ident(), function, item, refuse)
        finally:
            self._queued.pop()

    def _run(
        self,
        me: int,
        function: Callable[[T], object],
        item: T,
        refuse: Callable[[T], object] | None,
    ) -> None:
        gate = self._gate
        gate.running.append(me)
        try:
            if not (self.closed or gate.is_shut):
                function(item)
            elif refuse is not None:
                refuse(item)
        except Exception:  # noqa: BLE001  reported here, so that the next item is delivered
            report_thread_exception()
        finally:
            gate.running.remove(me)
            if gate.is_shut:
                gate.left.set()


# When a foreign thread calls back, CPython (3.11) makes a thread state for it and destroys that
# when the callback returns, mapping memory each time: about 14 us of a callback that otherwise
# takes 2. After one call of PyGILState_Ensure without its Release, the thread keeps its state.
# https://docs.python.org/3/c-api/init.html#non-python-created-threads
MAX_KNOWN_THREADS = 64  # threads; a library that starts more than these does not reuse its threads

_enter = ctypes.pythonapi.PyGILState_Ensure if sys.implementation.name == "cpython" else None

pinned: set[int] = set()
"""The ids of threads whose states are kept."""


def pin(me: int) -> None:
    """Keep the state of the calling thread, whose id is `me`, until the interpreter ends.

    A new thread with the id of an earlier one is not pinned again. That only costs it time.
    """
    if _enter is not None and len(pinned) < MAX_KNOWN_THREADS:
        _enter()
    pinned.add(me)
