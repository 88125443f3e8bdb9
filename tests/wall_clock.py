"""Clocks of computers whose wall time can be set, as by NTP or by hand."""

from __future__ import annotations


class Computer:
    """The clock of one computer: another clock, whose wall time is `ahead` by some seconds."""

    def __init__(self, clock, ahead=0.0):
        self._clock = clock
        self.ahead = ahead

    def time_ns(self):
        return self._clock.time_ns() + round(self.ahead * 1e9)

    def __getattr__(self, name):
        return getattr(self._clock, name)
