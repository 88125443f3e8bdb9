"""Time as in rospy: `Time`, `Duration`, `sleep`, `Rate`, on the current clock.

Source:
    rospy.rostime and rospy.timer for names, arguments and exceptions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core import shutdown
from actionlib_core.clock import current_clock
from actionlib_core.inputs.arguments import check_seconds
from actionlib_core.time import Duration, Time
from actionlib_core.time import TimeValue as TVal
from smachpy.ros1.names.rospy.exceptions import ROSInterruptException
from smachpy.ros1.session import session

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.clock import Task

__all__ = [
    "Duration",
    "Rate",
    "TVal",
    "Time",
    "Timer",
    "TimerEvent",
    "get_rostime",
    "get_time",
    "is_rostime_initialized",
    "is_wallclock",
    "set_rostime_initialized",
    "sleep",
    "wallsleep",
]


def get_time() -> float:
    """Return the seconds since 1970 of the current clock."""
    session().check_time()
    return Time.now().to_sec()


def get_rostime() -> Time:
    """Return `Time.now()`."""
    session().check_time()
    return Time.now()


def is_rostime_initialized() -> bool:
    """Return True: time is always known."""
    return True


def set_rostime_initialized(val: bool) -> None:
    """Do nothing: there is no simulated time to wait for."""
    del val


def is_wallclock() -> bool:
    """Return whether time is wall time."""
    from actionlib_core.clock import RealClock

    return isinstance(current_clock(), RealClock)


def wallsleep(duration: float) -> None:
    """Sleep, even if the program is to end.

    Blocks: for `duration` [s].
    """
    current_clock().sleep(float(duration))


def sleep(duration: float | Duration) -> None:
    """Sleep; a negative duration does nothing.

    Args:
        duration: Seconds, or a `Duration`.

    Raises:
        ROSInterruptException: the program is to end, now or during the sleep.

    Blocks: for `duration`.
    """
    now = session()
    now.check_time()
    seconds = float(duration)
    if seconds > 0:
        seconds = check_seconds("rospy.sleep", "duration", seconds)
        if now.dry:
            current_clock().sleep(seconds)
        else:
            shutdown.event().wait(seconds)
    if now.is_shutdown():
        raise ROSInterruptException("ROS shutdown request")


class Rate:
    """Keeps a loop at a frequency.

    Args:
        hz: Iterations per second, above 0.
        reset: Ignored; if the clock is set back, the iteration begins anew in any case.

    Raises:
        ValueError: `hz` is not above 0.
    """

    def __init__(self, hz: float, reset: bool = False) -> None:
        del reset
        if not float(hz) > 0:
            raise ValueError(f"Rate: hz: got {hz!r}; expected a number above 0.")
        self.last_time = Time.now()
        self.sleep_dur = Duration.from_sec(1.0 / float(hz))

    def remaining(self) -> Duration:
        """Return the remaining time of this iteration."""
        now = Time.now()
        self.last_time = min(self.last_time, now)  # the clock may have been set back by hours
        return self.sleep_dur - (now - self.last_time)

    def sleep(self) -> None:
        """Wait for the end of this iteration; after one that took far too long, start afresh.

        Raises:
            ROSInterruptException: the program is to end.

        Blocks: until then.
        """
        sleep(self.remaining())
        # Add the period instead of taking the time: small delays then do not lower the frequency.
        self.last_time = self.last_time + self.sleep_dur
        if Time.now() - self.last_time > self.sleep_dur * 2:
            self.last_time = Time.now()


class TimerEvent:
    """The argument of a timer's callback.

    Attributes:
        last_expected: When the last call was due; None in the first call.
        last_real: When it was made.
        current_expected: When this call was due.
        current_real: When it was made.
        last_duration: How long the last call took [s].
    """

    def __init__(
        self,
        last_expected: Time | None,
        last_real: Time | None,
        current_expected: Time,
        current_real: Time,
        last_duration: float | None,
    ) -> None:
        self.last_expected = last_expected
        self.last_real = last_real
        self.current_expected = current_expected
        self.current_real = current_real
        self.last_duration = last_duration


class Timer:
    """Calls a function periodically, or once.

    Args:
        period: Time between two calls, `Duration` or seconds, above 0.
        callback: Called with a `TimerEvent`.
        oneshot: Call it only once.
        reset: Ignored; time does not jump here.

    Raises:
        ValueError: `period` is not above 0.

    Threads: calls back in a thread of its own, until the program is to end; an exception ends it
        and is given to `threading.excepthook`.
    """

    daemon = True

    def __init__(
        self,
        period: float | Duration,
        callback: Callable[[TimerEvent], object],
        oneshot: bool = False,
        reset: bool = False,
    ) -> None:
        del reset
        self._period_s = check_seconds("rospy.Timer", "period", period)
        if not self._period_s > 0:
            raise ValueError(f"Timer: period: got {period!r}; expected more than 0 s.")
        self._callback = callback
        self._oneshot = oneshot
        self._clock = current_clock()
        self._shutdown = self._clock.event("the timer's end")
        self._forget = shutdown.on_shutdown(self._shutdown.set)
        self._task: Task | None = None
        if not session().dry:
            self._task = self._clock.spawn(self._run, name="rospy timer")

    def shutdown(self) -> None:
        """Make no more calls; does not wait for a running one."""
        self._shutdown.set()
        self._forget()

    def is_alive(self) -> bool:
        """Return whether it still makes calls."""
        return self._task is not None and self._task.is_alive()

    def join(self, timeout: float | None = None) -> None:
        """Wait until it has ended.

        Blocks: until then, or `timeout` [s].
        """
        if self._task is not None:
            self._task.join(timeout)

    def _run(self) -> None:
        last_expected: Time | None = None
        last_real: Time | None = None
        took: float | None = None
        due = self._clock.now() + self._period_s
        expected = Time.now() + self._period_s
        while not self._shutdown.wait(max(due - self._clock.now(), 0.0)):
            real, begun = Time.now(), self._clock.now()
            self._callback(TimerEvent(last_expected, last_real, expected, real, took))
            if self._oneshot:
                break
            last_expected, last_real, took = expected, real, self._clock.now() - begun
            # Calls that are overdue are skipped, not made up for.
            missed = max(int((self._clock.now() - due) / self._period_s), 0)
            due += self._period_s * (missed + 1)
            expected = expected + self._period_s * (missed + 1)
        self._forget()
