"""Lets time pass for simulated robots: one thread steps all of them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from actionlib_core.clock import Clock, Task

_LATE: Final = 0.5  # [s] a loop this late gives the lost time up instead of hurrying after it
_REPORTS: Final = 10.0  # [Hz] while something is busy; an order waits so long at most
_IDLE_PERIOD: Final = 0.5  # [s] between two reports when nothing is busy
_STOPS_IN: Final = 1.0  # [s] `close` waits so long for the thread


class Stepped(Protocol):
    """Something that changes with time."""

    def is_busy(self, now: float) -> bool:
        """Tell whether steps would change anything; called with the stepper's lock."""

    def step(self, now: float, dt: float) -> None:
        """Go on from `now` [s] by `dt` seconds; called with the stepper's lock."""

    def report(self, now: float) -> None:
        """Tell others what they should know by `now` [s]; called without any lock."""


class Stepper:
    """Steps what was added, in the order it was added, while any of it is busy.

    A few steps are made at once and time then catches up with them, so that the thread wakes for
    reports, not for steps. When nothing is busy it wakes twice a second, for reports only.

    Args:
        clock: Whose time it is.
        rate: Steps a second [Hz].

    Threads: every method may be called from any thread. `lock` keeps steps and orders apart; the
        clock is never waited for while it is held.

    Attributes:
        lock: Held during the steps.
    """

    def __init__(self, clock: Clock, *, rate: float = 20.0) -> None:
        self.lock = threading.RLock()
        self.rate = rate
        self._clock = clock
        self._dt = 1.0 / rate
        self._batch = max(1, round(rate / _REPORTS))
        self._things: tuple[Stepped, ...] = ()
        self._wake = clock.event("something to step")
        self._task: Task | None = None
        self._closing = False

    def add(self, thing: Stepped) -> None:
        """Step `thing` from now on; the first one starts the thread."""
        with self.lock:
            self._things = (*self._things, thing)
            if self._task is None:
                self._task = self._clock.spawn(self._run, name="simulation")
        self._wake.set()

    def remove(self, thing: Stepped) -> None:
        """Step `thing` no more; nothing happens when it was not there."""
        with self.lock:
            self._things = tuple(other for other in self._things if other is not thing)

    def wake(self) -> None:
        """Something has become busy."""
        self._wake.set()

    def close(self) -> None:
        """End the thread; a second call does nothing.

        Blocks: until it has ended, one second at most.
        """
        self._closing = True
        self._wake.set()
        if self._task is not None:
            self._task.join(_STOPS_IN)

    def _run(self) -> None:
        clock = self._clock
        reached = clock.now()  # the steps have come so far
        while not self._closing:
            if clock.now() - reached > _LATE:
                reached = clock.now()
            if self._step(reached):
                reached += self._batch * self._dt
                self._catch_up(reached)
            else:
                self._wake.wait(_IDLE_PERIOD)
                self._wake.clear()
                reached = max(reached, clock.now())
            for thing in self._things:
                thing.report(reached)

    def _catch_up(self, until: float) -> None:
        """Wait until the clock shows `until`, less when it is to end."""
        while not self._closing and (wait := until - self._clock.now()) > 0.0:
            self._clock.sleep(wait)

    def _step(self, now: float) -> bool:
        """Make one batch of steps; tells whether anything took part."""
        with self.lock:
            busy = [thing for thing in self._things if thing.is_busy(now)]
            for i in range(self._batch if busy else 0):
                for thing in busy:
                    thing.step(now + i * self._dt, self._dt)
        return bool(busy)
