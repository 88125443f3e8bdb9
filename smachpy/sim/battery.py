"""The battery: its energy changes at a known power, and is computed only on demand."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smachpy.places.robot_file import BatteryConfig

_SECONDS_PER_HOUR = 3600.0


class Battery:
    """The battery's charge as a function of time.

    Between two changes of power the charge is linear, so an idle robot needs no computation.

    Threads: every method may be called from any thread.
    """

    def __init__(self, config: BatteryConfig, now: float) -> None:
        self.config = config
        self._lock = threading.Lock()
        self._capacity = config.capacity * _SECONDS_PER_HOUR  # [J]
        self._energy = config.charge * self._capacity
        self._power = -config.idle_power
        self._since = now

    @property
    def power(self) -> float:
        """The power that flows in [W]; negative while it drains."""
        return self._power

    def charge(self, now: float) -> float:
        """Return the charge at time `now` [s], 0 to 1."""
        with self._lock:
            return self._at(now) / self._capacity

    def drive(self, now: float, share: float) -> None:
        """From now on, drain as for driving at `share` (0 to 1) of full speed."""
        self._flow(now, -self.config.idle_power - self.config.drive_power * share)

    def fill(self, now: float) -> None:
        """From now on, charge."""
        self._flow(now, self.config.charge_power)

    def seconds_until(self, level: float, now: float) -> float:
        """Return the time until its charge is `level` [s]; infinite if it never is."""
        with self._lock:
            missing = level * self._capacity - self._at(now)
        if missing <= 0.0:
            return 0.0
        return missing / self._power if self._power > 0.0 else math.inf

    def _flow(self, now: float, power: float) -> None:
        with self._lock:
            self._energy = self._at(now)
            self._since = now
            self._power = power

    def _at(self, now: float) -> float:
        energy = self._energy + self._power * (now - self._since)
        return max(0.0, min(self._capacity, energy))
