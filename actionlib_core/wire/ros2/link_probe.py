"""Notices that a link to a server is silent, long before its tokens disappear.

With the configuration of ROS 2 nodes, Zenoh keeps the tokens of a silent link for 60 s. A probe
requests the last status list, which servers keep for late subscribers: a node's network threads
answer that even while its executor is busy, and no callback of the node runs for it. A server that
has never had a goal has no list yet; it gets a request for the result of an unknown goal.
"""

from __future__ import annotations

import contextlib
import threading
from typing import TYPE_CHECKING

from actionlib_core.clock import SerialExecutor
from actionlib_core.exceptions import TransportError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.transport import Closable

WAIT_S = 2.0  # longest wait for the answer to a probe
LATE_S = 2.0  # a process that looks so late at the answer was stopped, and what came is unread


class LinkProbe:
    """Sends a probe when nothing was received on a link for a while.

    Args:
        clock: The clock.
        every: Sends a probe after this time without a message [s]; 0: never.
        ask: Sends a probe; the answer is to be noted with `note_received`. Raises TransportError
            when the session is closed.
        wanted: Returns whether the link matters now: somebody waits, and a server could answer.
        on_silent: Gets the time since the last message [s] when a probe was not answered; called
            again after each further probe without an answer.

    Attributes:
        last_received: When something was received last [s, clock].

    Threads: any; `ask` is called in a thread of its own, the other functions by the clock's timers.
    """

    def __init__(
        self,
        clock: Clock,
        every: float,
        ask: Callable[[], Closable],
        wanted: Callable[[], bool],
        on_silent: Callable[[float], None],
    ) -> None:
        self.last_received = clock.now()
        self._clock = clock
        self._every = every
        self._ask = ask
        self._wanted = wanted
        self._on_silent = on_silent
        self._lock = threading.Lock()
        self._sender = SerialExecutor(clock, "probe of a link")
        self._timer: Timer | None = None
        self._asked: Closable | None = None
        self._asked_at = 0.0
        self._is_second = False  # the first probe was judged too late
        self._closed = False

    def note_received(self) -> None:
        """Note that something was received."""
        self.last_received = self._clock.now()

    def watch(self) -> None:
        """Supervise the link from now on, as long as that is `wanted`."""
        self._later(self._every, self._look)

    def close(self) -> None:
        """Stop probing."""
        with self._lock:
            self._closed = True
            timer = self._timer
        if timer is not None:
            timer.cancel()
        self._keep(None)

    def _later(self, delay: float, step: Callable[[], None]) -> None:
        with self._lock:
            if self._every > 0 and self._timer is None and not self._closed:
                self._timer = self._clock.call_later(delay, step)

    def _look(self) -> None:
        self._timer = None
        # Summed in this order, it is at least one step of the clock's float. `every - (now -
        # last_received)` can be so small that a timer for it fires at the same time, without end.
        left = self.last_received + self._every - self._clock.now()
        if not self._wanted():
            self._keep(None)
        elif left > 0:
            self._later(left, self._look)
        else:
            # Not in the timers' thread: a query waits while a link is full.
            self._sender.submit(self._send)

    def _send(self) -> None:
        self._asked_at = self._clock.now()
        try:
            with contextlib.suppress(TransportError):  # the session is closed
                self._keep(self._ask())
        finally:
            self._later(min(self._every, WAIT_S), self._judge)  # once it is sent

    def _judge(self) -> None:
        self._timer = None
        now = self._clock.now()
        is_late = now - self._asked_at > min(self._every, WAIT_S) + LATE_S
        again, self._is_second = is_late and not self._is_second, False
        if self.last_received >= self._asked_at:
            self._keep(None)
        elif again:
            self._is_second = True
            self._look()  # and so probe once more
            return
        elif self._wanted():
            # The probe stays open: a late answer counts as well.
            self._on_silent(now - self.last_received)
        self.watch()

    def _keep(self, asked: Closable | None) -> None:
        """Close the last probe and keep `asked` instead."""
        with self._lock:
            last, self._asked = self._asked, None if self._closed else asked
        for old in (last, asked if self._closed else None):  # it may have been closed meanwhile
            if old is not None:
                old.close()
