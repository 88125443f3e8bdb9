"""Steps simulated robots through time: one thread steps all of them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Final, Protocol

if TYPE_CHECKING:
    from actionlib_core.clock import Clock, Task

JUST_PAST: Final = 1e-3  # [s] tolerance of due times: a rounding error must not skip one
_LATE: Final = 0.5  # [s] a loop that is later than this drops the lost time instead of catching up
_REPORTS: Final = 10.0  # [Hz] while anything is busy; also the longest delay of an order
_IDLE_PERIOD: Final = 0.5  # [s] between two reports if nothing is busy
_STOPS_IN: Final = 1.0  # [s] `close` waits for the thread at most this long


class Stepped(Protocol):
    """Something that changes with time."""

    def is_busy(self, now: float) -> bool:
        """Return whether steps would change anything; called with the stepper's lock."""

    def step(self, now: float, dt: float) -> None:
        """Advance from `now` [s] by `dt` seconds; called with the stepper's lock."""

    def report(self, now: float) -> None:
        """Publish what is due at `now` [s]; called without a lock."""


class Stepper:
    """Steps the added things, in the order in which they were added, while any of them is busy.

    It makes a batch of steps at once and then waits until time has caught up, so the thread wakes
    up for reports and not for every step. If nothing is busy it wakes up twice a second, for
    reports.

    Args:
        clock: The clock.
        rate: Steps per second [Hz].

    Threads: every method may be called from any thread. `lock` separates steps from orders; it is
        never held while waiting for the clock.

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
        """Step `thing` from now on; the first call starts the thread."""
        with self.lock:
            self._things = (*self._things, thing)
            if self._task is None:
                self._task = self._clock.spawn(self._run, name="simulation")
        self._wake.set()

    def remove(self, thing: Stepped) -> None:
        """Stop stepping `thing`, if it was added."""
        with self.lock:
            self._things = tuple(other for other in self._things if other is not thing)

    def wake(self) -> None:
        """Note that something has become busy."""
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
        reached = clock.now()  # the time up to which steps have been made
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
        """Wait until the clock shows `until`, or until the end."""
        while not self._closing and (wait := until - self._clock.now()) > 0.0:
            self._clock.sleep(wait)

    def _step(self, now: float) -> bool:
        """Make one batch of steps; return whether anything was busy."""
        with self.lock:
            busy = [thing for thing in self._things if thing.is_busy(now)]
            for i in range(self._batch if busy else 0):
                for thing in busy:
                    thing.step(now + i * self._dt, self._dt)
        return bool(busy)
