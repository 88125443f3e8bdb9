"""Where user callbacks run: off the network's thread, in order, knowing their clock and node."""

from __future__ import annotations

import contextvars
import threading
from functools import partial
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
        self._executor = SerialExecutor(node.clock, name)
        self._thread: int | None = None

    def call(self, function: Callable[..., object], *args: object) -> None:
        """Run `function(*args)` after everything given before."""
        self._context.copy().run(self._executor.submit, partial(self._run, function, args))

    def spawn(self, target: Callable[[], object], name: str) -> Task:
        """Run `target` in a thread of its own."""
        return self._context.copy().run(partial(self._clock.spawn, target, name=name))

    def is_inside(self) -> bool:
        """Tell whether the calling thread is running one of the callbacks."""
        return self._thread == threading.get_ident()

    def _run(self, function: Callable[..., object], args: tuple[object, ...]) -> None:
        self._thread = threading.get_ident()
        try:
            function(*args)
        finally:
            self._thread = None
