"""What a state waits on while it runs: one flag that a preempt and any other news may set."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.run.frame import clock_of_run
from smachpy.run.grace import on_preempt

if TYPE_CHECKING:
    from typing import Self

    from smachpy.machines.state import State


class Wakeup:
    """Wakes the thread that runs `state` for a preempt, for `set` and at a deadline.

    The loop around it loses nothing when it clears first, then looks at everything that may have
    happened, then waits. Used as a context manager; on leaving it the state is left alone.

    Threads: `set` from any thread, callback or signal handler; the rest by the state's thread.
    """

    __slots__ = ("_event", "_forget", "_state", "clock")

    def __init__(self, state: State) -> None:
        self._state = state
        self.clock = clock_of_run()
        self._event = self.clock.event()

    def __enter__(self) -> Self:
        self._forget = on_preempt(self._state, self._event.set)
        return self

    def __exit__(self, *_: object) -> None:
        self._forget()

    def set(self) -> None:
        """Wake the state; remembered until `clear`."""
        self._event.set()

    def clear(self) -> None:
        """Forget what was said; look at everything after this, not before."""
        self._event.clear()

    def wait_until(self, *deadlines: float | None) -> None:
        """Wait for news or the first of the deadlines [s, clock]; None is no deadline.

        Blocks: see above.
        """
        due = [deadline for deadline in deadlines if deadline is not None]
        self._event.wait(max(0.0, min(due) - self.clock.now()) if due else None)
