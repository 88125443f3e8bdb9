"""How foreign threads deliver to callbacks: in order, never on a caller's own stack, stoppable.

A network library may call back on its own threads and also inside a call of ours. `Inlet` evens
that out; `Gate` lets a session end with no callback left running.
"""

from __future__ import annotations

import ctypes
import sys
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, TypeVar

from actionlib_core.clock import RealClock
from actionlib_core.clock._serial import report_thread_exception

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import SerialExecutor

T = TypeVar("T")

POLL_S = 1e-3  # calls are many and their end is asked for once: looking is cheaper than telling


class Inside:
    """Which threads are in calls into the library; a callback on one of them is inline.

    A dictionary by thread, not a `threading.local`: a foreign thread is a new one to Python each
    time that it calls back, and would make its part of a local anew.

    Attributes:
        depths: How deep each thread is; one that is not is not there.
    """

    def __init__(self) -> None:
        self.depths: dict[int, int] = {}

    def __enter__(self) -> None:
        me = get_ident()
        self.depths[me] = self.depths.get(me, 0) + 1

    def __exit__(self, *_: object) -> None:
        me = get_ident()
        depth = self.depths.pop(me) - 1
        if depth:
            self.depths[me] = depth

    def wait_idle(self, timeout: float) -> None:
        """Wait until no other thread is in a call.

        Blocks: about `timeout` [s] at most after the last of them that came out of one; a time in
        which the process was stopped does not count.
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


class Gate:
    """Lets callbacks run until it is shut, and knows when the last one has returned.

    Who enters puts itself down before it looks whether the gate is shut, and who shuts it does so
    before looking who is down; list operations are atomic, so no lock is needed.

    Attributes:
        running: The threads that are in a callback, or about to look whether they may.
        is_shut: No callback may start.
        left: Set by each that leaves a gate that is shut.
    """

    def __init__(self) -> None:
        self.running: list[int] = []
        self.is_shut = False
        self.left = RealClock().event()

    def shut(self) -> None:
        """Let no callback start from now on."""
        self.is_shut = True

    def wait_idle(self, timeout: float) -> None:
        """Wait until no callback runs, not counting one that this thread is in itself.

        Blocks: `timeout` [s] at most.
        """
        deadline = RealClock.now() + timeout
        me = get_ident()
        while True:
            self.left.clear()
            left = deadline - RealClock.now()
            if left <= 0 or all(runner == me for runner in tuple(self.running)):
                return
            self.left.wait(left)


class Inlet:
    """Runs what the library delivers to one declaration: in order, never inside a call of ours.

    Args:
        gate: Decides whether a callback may still start.
        executor: Runs what arrives inside a call of ours.
    """

    __slots__ = ("_gate", "_queued", "_submit", "closed")

    def __init__(self, gate: Gate, executor: SerialExecutor) -> None:
        self._gate = gate
        self._submit = executor.submit
        self._queued: list[None] = []  # one for each that waits; list operations are atomic
        self.closed = False

    def take(
        self,
        function: Callable[[T], object],
        item: T,
        refuse: Callable[[T], object] | None = None,
    ) -> None:
        """Run `function(item)`, or `refuse(item)` when this is closed."""
        me = get_ident()
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
        except Exception:  # noqa: BLE001  a border: reported, the next item is delivered
            report_thread_exception()
        finally:
            gate.running.remove(me)
            if gate.is_shut:
                gate.left.set()


# CPython makes a thread state for a foreign thread that calls back and destroys it as the callback
# returns, with a mapping of memory each time: about 14 microseconds of a callback that otherwise
# takes 2 (3.11). A thread that has entered once more than it has left keeps its state.
# https://docs.python.org/3/c-api/init.html#non-python-created-threads
LONGEST = 64  # threads; a library that starts more of them than this has no pool worth keeping

_enter = ctypes.pythonapi.PyGILState_Ensure if sys.implementation.name == "cpython" else None

pinned: set[int] = set()
"""The threads that are kept, by their idents."""


def pin(me: int) -> None:
    """Keep the state of the calling thread, whose ident is `me`, until the interpreter ends.

    An ident that comes again for a new thread stays in `pinned`: that thread is not kept, which
    costs it time and nothing else.
    """
    if _enter is not None and len(pinned) < LONGEST:
        _enter()
    pinned.add(me)
