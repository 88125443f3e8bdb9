"""`StatusPublisher`: when a server sends the list of its goals."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from actionlib_core.exceptions import TransportError

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable

    from actionlib_core.clock import Clock, Timer
    from actionlib_core.goal.ports import ServerPort, StatusEntry
    from actionlib_core.goal.server import ServerGoals

log = logging.getLogger(__name__)

PERIOD_S = 1.0  # interval of the status lists while goals are listed
GAP_S = 0.02  # shortest interval of lists: changes within it share one
GAP_PER_GOAL_S = 100e-6  # added to `GAP_S` per tracked goal: long lists are sent less often
SHORT = 8  # goals; `hurry` sends only lists up to this length


class StatusPublisher:
    """Sends the status list and lets goals expire, with one timer that exists only while needed.

    The first change after a pause is sent at once; changes that follow within `GAP_S` share a list.

    Args:
        clock: The server's clock.
        lock: The server's lock, which guards `goals`.
        goals: The server's goals.
        port: The server's connection to the network; used without the lock.
        on_expired: Called without the lock after goals may have expired; returns at once.

    Threads: any; the timer's calls come on the clock's thread.
    """

    def __init__(
        self,
        clock: Clock,
        lock: threading.RLock,
        goals: ServerGoals,
        port: ServerPort,
        on_expired: Callable[[], object] = bool,
    ) -> None:
        self._clock = clock
        self._on_expired = on_expired
        self._lock = lock
        self._goals = goals
        self._port = port
        self._published = clock.now() - PERIOD_S  # when the last list was sent [s, clock]
        self._timer: Timer | None = None
        self._due = 0.0  # when the timer runs [s, clock]
        self._change_waits = False  # the timer is to send a list with a change
        self._closed = False

    def close(self) -> None:
        """Send nothing more."""
        with self._lock:
            self._closed = True
            if self._timer is not None:
                self._timer.cancel()

    def publish(self) -> None:
        """Send the list now."""
        with self._lock:
            if not self.claim(self._clock.now(), at_once=True):
                return
            listed = self._goals.list_statuses()
        self._send(listed)

    def on_change(self) -> None:
        """Send the list, now or soon, as a goal has changed."""
        # No lock is needed: a list that waits to be sent is made after this is reset, so it has the
        # change.
        if self._change_waits:
            return
        with self._lock:
            if not self.claim(self._clock.now()):
                return
            listed = self._goals.list_statuses()
        self._send(listed)

    def on_arrival(self) -> None:
        """Send the list within `GAP_S`, as a goal has come.

        Usually its code accepts it before that, which sends the list at once.
        """
        if self._change_waits:
            return
        with self._lock:
            if self._closed or self._change_waits:
                return
            self._change_waits = self._runs_by(self._clock.now() + GAP_S)

    def claim(self, now: float, *, at_once: bool = False) -> bool:
        """Prepare for a goal's change. The caller holds the lock until it has made the list.

        Returns:
            Whether the caller is to send the list: `at_once`, or because the last one is old
            enough. Otherwise the timer will send it, or nothing does as the server has stopped.
        """
        if self._closed:
            return False
        due = self._published + GAP_S + GAP_PER_GOAL_S * len(self._goals.tracked)
        if at_once or due <= now:
            self._change_waits = False
            self._published = now
            self._runs_by(now + PERIOD_S)
            return True
        if not self._change_waits:
            self._change_waits = self._runs_by(due)
            return not self._change_waits
        return False

    def expire_later(self) -> None:
        """Let goals expire when it is time, without sending a list."""
        with self._lock:
            soonest = self._goals.expire(self._clock.now())
            if self._timer is None and soonest is not None:
                self._runs_by(soonest)

    def _send(self, listed: list[StatusEntry]) -> None:
        try:
            self._port.send_status(listed)
        except TransportError:
            if not self._goals.closed:  # else the server was stopped in the meantime
                raise

    def hurry(self) -> None:
        """Send a waiting change now, unless the list is long."""
        if self._change_waits and len(self._goals.tracked) <= SHORT:
            self.publish()

    def _runs_by(self, due: float) -> bool:
        """Let the timer run at `due` at the latest; return whether it will. Needs the lock.

        Not if the system has no thread left for it: a goal can begin and end all the same.
        """
        if self._timer is not None and self._due <= due:
            return True
        try:
            timer = self._clock.call_later(due - self._clock.now(), self._on_timer)
        except RuntimeError:
            return False
        if self._timer is not None:
            self._timer.cancel()
        self._timer, self._due = timer, due
        return True

    def _on_timer(self) -> None:
        with self._lock:
            self._timer = None
            if self._closed:
                return
            now = self._clock.now()
            soonest = self._goals.expire(now)
            due = self._change_waits
            if not due:
                repeated = self._published + PERIOD_S
                if now < repeated:  # a list was sent after the timer was set
                    self._runs_by(repeated)
                elif self._goals.listed():
                    due = True
                elif soonest is not None:  # an empty list is not repeated
                    self._runs_by(soonest)
        self._on_expired()
        if not due:
            return
        try:
            self.publish()
        except TransportError as error:  # the program has closed the session, not the server
            self.close()
            log.warning("%s Its status is no longer sent.", error)
