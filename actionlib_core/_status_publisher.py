"""When a server says how its goals stand: on changes and once a second, never in a flood."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable

    from actionlib_core._core.server_goals import ServerGoal, ServerGoals
    from actionlib_core.clock import Clock, Timer

PERIOD_S = 1.0  # while goals are tracked
GAP_S = 0.02  # changes that follow each other faster share a message
SHORT = 8  # goals; a longer list is not sent before its time
GAP_PER_GOAL_S = 100e-6  # a long list is sent less often


class StatusPublisher:
    """Sends the list of goals, and lets goals expire, with one timer that exists while needed.

    The first change after a pause is sent at once; those that follow within `GAP_S` go together.

    Args:
        clock: Gives time and the timer.
        lock: The server's lock, which guards `goals`.
        goals: The server's goals.
        send: Sends a list of goals; called without the lock.

    Threads: any; the timer's calls come on the clock's thread.
    """

    def __init__(
        self,
        clock: Clock,
        lock: threading.RLock,
        goals: ServerGoals,
        send: Callable[[list[ServerGoal]], None],
    ) -> None:
        self._clock = clock
        self._lock = lock
        self._goals = goals
        self._send = send
        self._published = clock.now() - PERIOD_S
        self._timer: Timer | None = None
        self._due = 0.0
        self._change_waits = False
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
            if self._closed:
                return
            self._change_waits = False
            now = self._clock.now()
            self._published = now
            listed = self._goals.listed()
            self._arm(now + PERIOD_S)
        self._send(listed)

    def on_change(self) -> None:
        """Note that a goal has changed: send the list now or soon."""
        if self._change_waits:  # the list is made after this is reset, so this change is in it
            return
        with self._lock:
            now = self._clock.now()
            due = self._published + GAP_S + GAP_PER_GOAL_S * len(self._goals)
            if due > now:
                if not self._closed:
                    self._change_waits = True
                    if self._timer is None or due < self._due:
                        self._arm(due)
                return
        self.publish()

    def hurry(self) -> None:
        """Send a change that waits for others now, unless the list is long."""
        if self._change_waits and len(self._goals) <= SHORT:
            self.publish()

    def _arm(self, due: float) -> None:
        """Let the timer run at `due`. Needs the lock."""
        if self._timer is not None:
            self._timer.cancel()
        self._due = due
        self._timer = self._clock.call_later(due - self._clock.now(), self._on_timer)

    def _on_timer(self) -> None:
        with self._lock:
            self._timer = None
            if self._closed:
                return
            soonest = self._goals.expire(self._clock.now())
            since = self._clock.now() - self._published
            if not self._change_waits and since > PERIOD_S / 2 and not self._goals.listed():
                if soonest is not None:
                    self._arm(soonest)
                return
        self.publish()
