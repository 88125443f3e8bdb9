"""The wall time of a clock, which is for people: it can be set at any time.

Whatever is compared or measured uses the monotonic time. So a step of the wall clock changes
nothing but the stamps that people read; it is logged, as it explains them.
"""

from __future__ import annotations

import _thread
import weakref
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actionlib_core.clock._protocol import Clock

STEP_S = 0.5  # a greater difference between the two times is a step


class WallTime:
    """Stamps of one clock that always increase, and reports of its steps.

    Threads: any thread and signal handler; nothing here waits.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = weakref.proxy(clock)
        self._offset_ns = self._measure_ns()
        self._last_ns = 0
        self._checking = _thread.allocate_lock()

    def _measure_ns(self) -> int:
        """Return the difference between wall time and monotonic time [ns]."""
        clock: Clock = self._clock
        return clock.time_ns() - round(clock.now() * 1e9)

    def stamp_ns(self) -> int:
        """Return the wall time [ns since the epoch], later than every stamp before.

        After the clock was put back, stamps increase by 1 ns until it has caught up.
        """
        self.check()
        # Without a lock: two threads may get one stamp, which only means that neither was first.
        clock: Clock = self._clock
        stamp_ns = self._last_ns = max(clock.time_ns(), self._last_ns + 1)
        return stamp_ns

    def check(self) -> float:
        """Log if the wall clock was set since the last call; return by how much [s], else 0."""
        if not self._checking.acquire(blocking=False):  # another thread does it now
            return 0.0
        try:
            offset_ns = self._measure_ns()
            step = (offset_ns - self._offset_ns) / 1e9
            if abs(step) < STEP_S:
                return 0.0
            self._offset_ns = offset_ns
        finally:
            self._checking.release()
        import logging  # here: it takes 4 ms, and programs with state machines only never need it

        logging.getLogger("actionlib_core.clock").warning(
            "the computer's clock was %s by %.1f s%s. Deadlines, durations and the order of goals "
            "do not depend on it; the times in logs and records do.",
            "put back" if step < 0 else "set forward",
            abs(step),
            "" if step < 0 else ", or the computer was suspended for that time",
        )
        return step


_walls: weakref.WeakKeyDictionary[Clock, WallTime] = weakref.WeakKeyDictionary()


def wall_time(clock: Clock) -> WallTime:
    """Return the `WallTime` of a clock; there is one."""
    found = _walls.get(clock)
    return found if found is not None else _walls.setdefault(clock, WallTime(clock))
