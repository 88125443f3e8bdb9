"""Threads for the participants of virtual clocks: used again, and started by their first turn."""

from __future__ import annotations

import os
import threading
from typing import TYPE_CHECKING, Protocol

from actionlib_core.clock._gates import make_gate
from actionlib_core.clock._real import IDLE_NAME, IDLE_S

if TYPE_CHECKING:
    from actionlib_core.clock._gates import Gate


class Turns(Protocol):
    """What a thread runs from its first turn on."""

    name: str

    def run_turns(self, worker: Worker) -> None:
        """Do the work; lets nothing through, and calls `worker.free` with the turn still had."""
        ...


class Worker:
    """One cached thread; it waits at its gate between two jobs too, and ends after `IDLE_S`.

    Attributes:
        gate: Gives it the turn, of which the first begins its job.
    """

    def __init__(self) -> None:
        self.gate: Gate = make_gate()
        self._job: Turns | None = None
        self._thread = threading.Thread(target=self._run, name=IDLE_NAME, daemon=True)
        self._thread.start()

    def give(self, job: Turns) -> None:
        """Let its next turn begin `job`."""
        self._job = job

    def free(self) -> None:
        """Take the next job, as soon as this one has come to its end."""
        _idle.append(self)

    def _run(self) -> None:
        while True:
            if not self.gate.acquire_within(IDLE_S):
                try:
                    _idle.remove(self)
                except ValueError:  # chosen at the last moment
                    self.gate.acquire()
                else:
                    return
            job, self._job = self._job, None
            assert job is not None
            self._thread.name = job.name
            job.run_turns(self)
            del job


# Newest first. No lock: list operations are atomic.
_idle: list[Worker] = []


def take_worker() -> Worker:
    """Return a thread without a job."""
    try:
        return _idle.pop()
    except IndexError:
        return Worker()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # the threads stay with the parent
