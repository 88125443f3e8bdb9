"""The options of the test session for every mission under test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.testing.runs import Run


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """A test session.

    Attributes:
        seeds: The seeds; each test runs with all of them. None: threads take turns.
        rate: Virtual seconds per real second; None: as fast as possible.
        on_run: Called with every run, for coverage.
        on_cut: Called with a text for each exploration that a limit has ended.
    """

    seeds: tuple[int | None, ...] = (None,)
    rate: float | None = None
    on_run: Callable[[Run], object] | None = None
    on_cut: Callable[[str], object] | None = None


_sessions = [Session()]


def current() -> Session:
    """Return the innermost current session; outside of any, one with the defaults."""
    return _sessions[-1]


def begin(session: Session) -> None:
    """Begin a session."""
    _sessions.append(session)


def end(session: Session) -> None:
    """End a session; does nothing if it has not begun."""
    if session in _sessions[1:]:
        _sessions.remove(session)
