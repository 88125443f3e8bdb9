"""Waits that a preempt ends: an event of the running state, and blocking calls in a thread."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from smachpy.engine.frame import clock_of_run
from smachpy.engine.preempt import on_preempt
from smachpy.engine.shutdown_check import is_shutdown

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Self

    from smachpy.machines.state import State

R = TypeVar("R")


class PreemptedError(Exception):
    """A preempt has ended a call of a state, and was serviced."""


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


def call_blocking(
    state: State, function: Callable[[], R], stop: Callable[[], object], name: str
) -> R:
    """Call a function that blocks, in a thread of its own, so that a preempt can end the call.

    Args:
        state: The running state.
        function: The function.
        stop: Makes it raise soon; called at a preempt, in the state's thread.
        name: Name of the thread.

    Raises:
        PreemptedError: the state was asked to stop before the function had returned. It is not
            called if the state was asked before.
        BaseException: what the function raised, unless a preempt or the shutdown was the reason.

    Blocks: until the function has returned or raised.
    """
    results: list[R] = []
    errors: list[BaseException] = []

    with Wakeup(state) as wake:
        if answer_preempt(state):
            raise PreemptedError

        def run() -> None:
            try:
                results.append(function())
            except BaseException as error:  # noqa: BLE001  raised in the state's thread
                errors.append(error)
            finally:
                wake.set()

        task = wake.clock.spawn(run, name=name)
        try:
            while not (results or errors or state.preempt_requested()):
                wake.wait_until()
                wake.clear()
        except BaseException:
            stop()  # such as KeyboardInterrupt: do not leave the thread behind
            raise
        if not (results or errors):
            stop()
            task.join()
            if answer_preempt(state):
                raise PreemptedError
    if errors:
        if answer_preempt(state) or is_shutdown():
            raise PreemptedError
        raise errors[0]
    return results[0]
