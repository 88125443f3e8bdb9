"""Cached threads for the participants of virtual clocks; a thread's first turn starts its job."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING, Protocol

from actionlib_core.clock._gates import make_gate
from actionlib_core.clock._real import IDLE_NAME, IDLE_S

if TYPE_CHECKING:
    from actionlib_core.clock._gates import Gate


class Turns(Protocol):
    """The job of a thread: a `VirtualTask`, whose module imports this one."""

    name: str

    def run_turns(self, worker: Worker) -> None:
        """Do the job; raises nothing, and calls `worker.free` before it gives the turn away."""
        ...


class Worker:
    """One cached thread. Between two jobs it waits at its gate, and ends after `IDLE_S`.

    Attributes:
        gate: Gives it its turns; the first one starts its job.
    """

    def __init__(self) -> None:
        self.gate: Gate = make_gate()
        self._job: Turns | None = None
        self._thread = threading.Thread(target=self._run, name=IDLE_NAME, daemon=True)
        self._thread.start()

    def give(self, job: Turns) -> None:
        """Let its next turn start `job`."""
        self._job = job

    def free(self) -> None:
        """Offer this thread for the next job, which starts when the present one has ended."""
        _idle.append(self)

    def _run(self) -> None:
        while True:
            if not self.gate.acquire_within(IDLE_S):
                try:
                    _idle.remove(self)
                except ValueError:  # `take_worker` was faster: the turn comes soon
                    self.gate.acquire()
                else:
                    return
            job, self._job = self._job, None
            assert job is not None
            self._thread.name = job.name
            job.run_turns(self)
            del job


# Newest last. No lock is needed, as list operations are atomic.
_idle: list[Worker] = []


def take_worker() -> Worker:
    """Return a thread without a job."""
    try:
        return _idle.pop()
    except IndexError:
        return Worker()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # the threads exist only in the parent
