"""The event on which a state waits while it runs: set by a preempt and by anything else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.engine.frame import clock_of_run
from smachpy.engine.preempt import on_preempt

if TYPE_CHECKING:
    from typing import Self

    from smachpy.machines.state import State


def answer_preempt(state: State) -> bool:
    """Service a request to `state`, if there is one; return whether there was."""
    if not state.preempt_requested():
        return False
    state.service_preempt()
    return True


class Wakeup:
    """Wakes the state's thread at a preempt, at `set` and at a deadline; a context manager.

    A loop misses nothing if it first clears it, then checks everything that may have happened, and
    then waits.

    Threads: `set` from any thread, callback or signal handler; the rest in the state's thread.
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
        """Wake the state; stays set until `clear`."""
        self._event.set()

    def clear(self) -> None:
        """Reset it; check everything after this call, not before."""
        self._event.clear()

    def wait_until(self, *deadlines: float | None) -> None:
        """Wait until it is set, or until the first deadline [s, clock]; None is no deadline.

        Blocks: see above.
        """
        due = [deadline for deadline in deadlines if deadline is not None]
        self._event.wait(max(0.0, min(due) - self.clock.now()) if due else None)
