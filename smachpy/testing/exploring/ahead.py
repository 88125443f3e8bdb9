"""Runs of an exploration in other processes, ahead of the search that asks for them.

The search takes the runs in its own order, whatever process did them, so what it finds does not
depend on the number of processes.
"""

from __future__ import annotations

import pickle
from collections import deque
from typing import TYPE_CHECKING, Any, Final

from smachpy.base.workers import MOST_TRIES, WorkerProcess, cores
from smachpy.machines.container import Container

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Self, TypeAlias

    from smachpy.testing.exploring.search import ScheduleChoice, Search
    from smachpy.testing.runs import Run

    Prefix: TypeAlias = tuple[int, ...]
    Found: TypeAlias = tuple[list[ScheduleChoice], Run | None]

AFTER_S: Final = 2.0
"""Explorations that take no longer have one process: others take a second to begin [s]."""

TOGETHER: Final = 16
"""Runs that a process does without asking for more."""

COMPARED: Final = 4
"""Runs of this process that each other one does, too, before its own count."""


class Ahead:
    """Does the next runs of a search in other processes; a context manager.

    A process in which the first runs are not the same as here is not used: such as one in which a
    set of texts has another order.

    Args:
        job: Machine, invariants, grace and options, as the function that is called has them. If
            they cannot be sent to another process (a machine instead of a function, a lambda, what
            a program's own file defines), no other process is used.
        jobs: Number of processes; None: all cores.
        wants_runs: Whether the runs are needed, besides their choices.
    """

    def __init__(self, job: tuple[Any, ...], jobs: int | None, *, wants_runs: bool) -> None:
        self._count = cores() if jobs is None else jobs
        self._wants_runs = wants_runs
        self._job = b"" if self._count == 1 else _pickled(job)
        self._known: list[tuple[Prefix, list[ScheduleChoice]]] = []
        self._processes: list[WorkerProcess] = []
        self._asked: deque[tuple[int, list[Prefix], int]] = deque()  # process, runs, its try
        self._ready: deque[tuple[Prefix, Found | None]] = deque()
        self._next = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.kill()
            process.end()

    def found(self, prefix: Prefix, search: Search) -> Found | None:
        """Return a run that keeps all invariants; None if it is not known to be one.

        Args:
            prefix: What `search.next` has returned.
            search: The search; its next runs are begun.

        Blocks: until the run has been done.
        """
        if not self._job or not self._known:
            return None
        if not self._processes:
            self._processes = [WorkerProcess() for _ in range(self._count)]
            self._compare()
        if self._job and not self._ready and not self._asked:
            self._ask([prefix])
        self._ask_for(search)
        while not self._ready and self._asked:
            self._receive()
            self._ask_for(search)
        known, result = self._ready.popleft() if self._ready else (prefix, None)
        assert known == prefix, "runs come in the order of the search"
        return result

    def note(self, prefix: Prefix, choices: list[ScheduleChoice]) -> None:
        """Note a run that this process has done, and that keeps all invariants."""
        if self._job and len(self._known) < COMPARED:
            self._known.append((prefix, choices))

    def _compare(self) -> None:
        """Use no other process unless all do the known runs as this one."""
        prefixes = [prefix for prefix, _ in self._known]
        for number in range(self._count):
            self._ask(prefixes, process=number)
        while self._asked:
            self._receive()
        results = [None if found is None else found[0] for _, found in self._ready]
        self._ready.clear()
        if results != [choices for _, choices in self._known] * self._count:
            self._job = b""

    def _ask_for(self, search: Search) -> None:
        """Keep all processes busy with the runs that come next."""
        if not self._job:
            return
        begun = len(self._ready) + sum(len(prefixes) for _, prefixes, _ in self._asked)
        # The search waits for the first of these, and no longer has it.
        waiting = search.waiting(begun - 1, 2 * self._count * TOGETHER)
        while waiting and len(self._asked) < 2 * self._count:
            # All processes get some of a few runs.
            size = min(TOGETHER, -(-len(waiting) // self._count))
            self._ask(waiting[:size])
            waiting = waiting[size:]

    def _ask(self, prefixes: list[Prefix], tries: int = 1, process: int | None = None) -> None:
        if process is None:  # in turn, as the answers are taken in the order of the questions
            process, self._next = self._next, (self._next + 1) % self._count
        self._asked.append((process, prefixes, tries))
        self._send(process, prefixes)

    def _send(self, process: int, prefixes: list[Prefix]) -> None:
        task: Any = (runs_of, (self._job, prefixes, self._wants_runs), {})
        try:
            self._processes[process].connection.send(task)
        except ConnectionError:  # it is dead; `_receive` finds out
            return

    def _receive(self) -> None:
        """Take the next answer; if its process has died, another one does the runs again."""
        number, prefixes, tries = self._asked[0]
        try:
            results, error = self._processes[number].connection.recv()
        except (EOFError, ConnectionError):
            self._processes[number].end()
            self._processes[number] = WorkerProcess()
            again = [(p, runs, n) for p, runs, n in self._asked if p == number]
            self._asked[0] = (number, prefixes, tries + 1)
            if tries < MOST_TRIES:
                for _, runs, _ in again:
                    self._send(number, runs)
                return
            results, error = None, "it dies"
            self._job = b""
        if error is not None:  # such as a module that cannot be imported there
            self._job, self._asked = b"", deque()
            return
        self._asked.popleft()
        self._ready.extend(zip(prefixes, results, strict=True))


def _pickled(job: tuple[Any, ...]) -> bytes:
    """Return what another process makes the runs of; nothing if that cannot be sent."""
    if isinstance(job[0], Container):
        return b""
    try:
        made = pickle.dumps(job)
    except Exception:  # noqa: BLE001  of any kind: the values' own code decides
        return b""
    return b"" if b"__main__" in made else made


def runs_of(job: bytes, prefixes: Sequence[Prefix], wants_runs: bool) -> list[Found | None]:
    """Do runs; return None for each that breaks an invariant, or is not possible.

    Blocks: until they are done.
    """
    from smachpy.testing.exploring.exploration import RepeatedRun, ReplayError
    from smachpy.testing.exploring.verdicts import judge

    machine, invariants, grace, options = pickle.loads(job)  # noqa: S301  of the process that began this one
    found: list[Found | None] = []
    with RepeatedRun("explore", machine, options, merges=not invariants) as runner:
        for prefix in prefixes:
            try:
                run, error = runner.run(prefix)
            except ReplayError:
                found.append(None)
                continue
            explorer = runner.explorer
            is_ok = judge(run, error, explorer, grace=grace, invariants=invariants) is None
            found.append((explorer.choices, run if wants_runs else None) if is_ok else None)
    return found
