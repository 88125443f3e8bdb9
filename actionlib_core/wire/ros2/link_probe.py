"""Notices that a server is not heard any more, long before its tokens say so.

A ROS 2 node takes a link for dead after 60 s of silence. The last status list, which servers keep
for subscribers that come late, is answered by a node's network threads even while its executor is
busy, and no callback runs there for it: asking for it again tells whether the link is there. A
server that has never had a goal keeps no list; it is asked for the result of an unknown goal.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from actionlib_core.exceptions import TransportError

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.transport import Closable

WAIT_S = 2.0  # longest wait for the answer to a probe


class LinkProbe:
    """Asks whether a link is there when nothing was heard on it for a while.

    Args:
        clock: Gives time.
        every: After so much silence it asks [s]; 0: never.
        ask: Asks; whatever is heard then is noted with `hear`. Raises TransportError when the
            session is closed.
        wanted: Tells whether anybody is interested, and there is somebody to answer.
        on_silent: Gets for how long nothing was heard [s], when nothing came in answer either;
            called again after each further probe without an answer.

    Attributes:
        heard: When something was heard last [s, clock].

    Threads: any; the functions are called by the clock's timer thread.
    """

    def __init__(
        self,
        clock: Clock,
        every: float,
        ask: Callable[[], Closable],
        wanted: Callable[[], bool],
        on_silent: Callable[[float], None],
    ) -> None:
        self.heard = clock.now()
        self._clock = clock
        self._every = every
        self._ask = ask
        self._wanted = wanted
        self._on_silent = on_silent
        self._lock = threading.Lock()
        self._timer: Timer | None = None
        self._asked: Closable | None = None
        self._closed = False

    def hear(self) -> None:
        """Note that something was heard."""
        self.heard = self._clock.now()

    def watch(self) -> None:
        """Look after the link from now on, as long as that is `wanted`."""
        self._later(self._every, self._look)

    def close(self) -> None:
        """Ask no more."""
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
        left = self.heard + self._every - self._clock.now()  # rounded, it lets time pass
        if not self._wanted():
            self._keep(None)
        elif left > 0:
            self._later(left, self._look)
        else:
            self._later(min(self._every, WAIT_S), self._judge)
            try:
                self._keep(self._ask())
            except TransportError:  # the session is closed
                return

    def _judge(self) -> None:
        self._timer = None
        quiet = self._clock.now() - self.heard
        if quiet < self._every:
            self._keep(None)
        elif self._wanted():
            self._on_silent(quiet)  # what was asked stays open: a late answer counts, too
        self.watch()

    def _keep(self, asked: Closable | None) -> None:
        """Close the last question; keep `asked` instead."""
        with self._lock:
            last, self._asked = self._asked, asked
        if last is not None:
            last.close()
