"""Do something soon after a change, off the thread that made it, and not too often."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock, SerialExecutor


class Pace:
    """Calls `function` after each `mark`, once for all marks that come within `interval_s`.

    Args:
        clock: Time.
        executor: Runs `function`.
        function: May block.
        interval_s: Shortest time between two calls [s]; the first mark after a pause causes a call
            at once.

    Threads: `mark` from any thread; it never waits. `function` runs in the executor.
    """

    def __init__(
        self,
        clock: Clock,
        executor: SerialExecutor,
        function: Callable[[], object],
        interval_s: float,
    ) -> None:
        self._clock = clock
        self._executor = executor
        self._function = function
        self._interval_s = interval_s
        self._lock = threading.Lock()
        self._waiting = False
        self._closed = False
        self._last = -interval_s

    def mark(self) -> None:
        """Say that something changed."""
        with self._lock:
            if self._waiting or self._closed:
                return
            self._waiting = True
            delay = max(0.0, self._last + self._interval_s - self._clock.now())
        self._clock.call_later(delay, lambda: self._executor.submit(self._run))

    def close(self) -> None:
        """Start no more calls."""
        self._closed = True

    def _run(self) -> None:
        with self._lock:
            self._waiting = False
            self._last = self._clock.now()
        if not self._closed:
            self._function()
