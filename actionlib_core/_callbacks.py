"""Where user callbacks run: off the network's thread, in order, knowing their clock and node."""

from __future__ import annotations

import contextvars
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING

from actionlib_core.clock import SerialExecutor, use_clock
from actionlib_core.node import use_node

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Task
    from actionlib_core.node import Node


class CallbackQueue:
    """Runs the callbacks of one client or server, one at a time, in the order they were given.

    They run with the owner's clock and node as the current ones. No thread exists while idle.

    Threads: any; `call` never waits, so it may be used under a lock.
    """

    def __init__(self, node: Node, name: str) -> None:
        with use_clock(node.clock), use_node(node):
            self._context = contextvars.copy_context()
        self._clock = node.clock
        self._executor = SerialExecutor(_Marking(self), name)
        self._thread: int | None = None

    def call(self, function: Callable[..., object], *args: object) -> None:
        """Run `function(*args)` after everything given before."""
        self._executor.submit(partial(function, *args) if args else function)

    def spawn(self, target: Callable[[], object], name: str) -> Task:
        """Run `target` in a thread of its own, with the owner's clock and node."""
        return self._context.copy().run(partial(self._clock.spawn, target, name=name))

    def is_inside(self) -> bool:
        """Tell whether the calling thread is running one of the callbacks."""
        return self._thread == get_ident()

    def mark(self, target: Callable[[], object]) -> None:
        """Run `target`, and know that this thread runs callbacks meanwhile."""
        me = self._thread = get_ident()
        try:
            target()
        finally:
            if self._thread == me:  # else the next one has begun
                self._thread = None


class _Marking:
    """Starts the thread that runs the callbacks of a queue."""

    def __init__(self, queue: CallbackQueue) -> None:
        self._queue = queue

    def spawn(self, target: Callable[[], object], *, name: str) -> Task:
        return self._queue.spawn(partial(self._queue.mark, target), name)
