"""The clock of a computer that is set while a process runs, as by NTP or by hand."""

from __future__ import annotations

import random
import signal
import time

from actionlib_core.clock import RealClock

FARTHEST_S = 7200.0


def set_on(number: int, seed: int) -> None:
    """Let a signal set the wall clock of this process by up to two hours, ahead or back."""
    rng = random.Random(seed)
    ahead_ns = 0

    def changed(clock: RealClock) -> int:
        del clock
        return time.time_ns() + ahead_ns

    def step(*_: object) -> None:
        nonlocal ahead_ns
        ahead_ns = round(rng.uniform(-FARTHEST_S, FARTHEST_S) * 1e9)

    RealClock.time_ns = changed  # it is `time.time_ns` itself
    signal.signal(number, step)
