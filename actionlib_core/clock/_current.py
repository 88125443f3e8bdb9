"""The clock in force here: a context variable, so that tests can swap it for one call tree."""

from __future__ import annotations

import contextlib
from contextvars import ContextVar
from typing import TYPE_CHECKING

from actionlib_core.clock._real import RealClock

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actionlib_core.clock._protocol import Clock

_REAL = RealClock()
_clock: ContextVar[Clock] = ContextVar("clock", default=_REAL)


def current_clock() -> Clock:
    """Return the clock of this context: the one of `use_clock`, else the process's real clock."""
    return _clock.get()


@contextlib.contextmanager
def use_clock(clock: Clock) -> Iterator[Clock]:
    """Make `clock` the current one inside the `with` block, also for tasks spawned in it."""
    token = _clock.set(clock)
    try:
        yield clock
    finally:
        _clock.reset(token)
