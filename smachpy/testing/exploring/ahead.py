"""Runs of an exploration in other processes, ahead of the search that asks for them.

The search takes the runs in its own order, whatever process did them, so what it finds does not
depend on the number of processes.
"""

from __future__ import annotations

import pickle
from collections import deque
from functools import partial
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from smachpy.base.workers import Workers, cores
from smachpy.machines.container import Container

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future
    from typing import Self, TypeAlias

    from smachpy.base.cluster import Cluster
    from smachpy.testing.exploring.explorer import Orders
    from smachpy.testing.exploring.search import ScheduleChoice, Search
    from smachpy.testing.runs import Run

    Prefix: TypeAlias = tuple[int, ...]
    Known: TypeAlias = list[tuple[Prefix, list[ScheduleChoice]]]
    Found: TypeAlias = tuple[list[ScheduleChoice], Run | None, Orders]

TOGETHER: Final = 32
"""Runs that a process does without asking for more; to begin them costs as much as one."""

COMPARED: Final = 4
"""Runs of this process that each other one does, too, before its own count."""

BEGIN: Final = -1
"""Number of a question without runs: whether a process can do them."""


class Ahead:
    """Does the next runs of a search in other processes; a context manager.

    This process goes on by itself until another one has begun, which takes a second or more.
    If a process does the first runs not as this one, no other process is used: such as one in which
    a set of texts has another order.

    Args:
        runs_of: Does runs of a job; see `exploration.runs_of`.
        job: Machine, invariants, grace and options, as the function that is called has them. If
            they cannot be sent to another process (a machine instead of a function, a lambda, what
            a program's own file defines), no other process is used.
        jobs: Number of processes; None: all cores.
        cluster: Has the processes; None: this computer.
        wants_runs: Whether the runs are needed, besides their choices.
    """

    def __init__(
        self,
        runs_of: Callable[[bytes, Known, Sequence[Prefix], bool], list[Found | None] | None],
        job: tuple[Any, ...],
        jobs: int | None,
        cluster: Cluster | None,
        *,
        wants_runs: bool,
    ) -> None:
        self._runs_of = runs_of
        self._cluster = cluster
        self._count = cluster.count if cluster is not None else cores() if jobs is None else jobs
        self._wants_runs = wants_runs
        self._job = b"" if cluster is None and self._count == 1 else _pickled(job)
        self._known: Known = []
        self._asked: deque[list[Prefix]] = deque()
        self._ready: deque[tuple[Prefix, Found | None]] = deque()
        self._answers: dict[int, list[Found | None] | None] = {}  # by the number of the question
        self._sent = self._taken = 0
        self._is_beginning = self._is_ready = False
        # The runs of this process have their own time, in which nothing can be waited for that
        # others do. So a thread which is not in it asks, over queues that are not in it either.
        self._questions: SimpleQueue[tuple[int, tuple[Any, ...]] | None] = SimpleQueue()
        self._answered: SimpleQueue[tuple[int, list[Found | None] | None]] = SimpleQueue()
        self._thread = RealClock().spawn(self._send, name="explore ahead")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._questions.put(None)
        self._thread.join()

    def found(self, prefix: Prefix, search: Search) -> Found | None:
        """Return a run that keeps all invariants; None if this process is to do it.

        Args:
            prefix: What `search.next` has returned.
            search: The search; its next runs are begun.

        Blocks: until the run has been done; not while the first process begins.
        """
        if not self._known or (self._job and not self._has_begun()):
            return None
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
        if self._job and not self._is_beginning and len(self._known) < COMPARED:
            self._known.append((prefix, choices))

    def _has_begun(self) -> bool:
        """Let the processes begin, once; return whether one of them is ready for runs."""
        if not self._is_beginning:
            self._is_beginning = True
            for _ in range(self._count):
                self._question(BEGIN, [])
        while not self._is_ready and not self._answered.empty():
            self._take_answer()
        return self._is_ready

    def _ask_for(self, search: Search) -> None:
        """Keep all processes busy with the runs that come next."""
        if not self._job or len(self._asked) >= 2 * self._count:
            return
        begun = len(self._ready) + sum(map(len, self._asked))
        # The search waits for the first of these, and no longer has it.
        waiting = search.waiting(begun - 1, 2 * self._count * TOGETHER)
        while waiting and len(self._asked) < 2 * self._count:
            # All processes get some of a few runs.
            size = min(TOGETHER, -(-len(waiting) // self._count))
            self._ask(waiting[:size])
            waiting = waiting[size:]

    def _ask(self, prefixes: list[Prefix]) -> None:
        self._asked.append(prefixes)
        self._question(self._sent, prefixes)
        self._sent += 1

    def _question(self, number: int, prefixes: list[Prefix]) -> None:
        self._questions.put((number, (self._job, self._known, prefixes, self._wants_runs)))

    def _receive(self) -> None:
        """Take the answer to the first question that has none yet."""
        while self._taken not in self._answers:
            self._take_answer()
        found = self._answers.pop(self._taken)
        self._taken += 1
        prefixes = self._asked.popleft()
        if found is None:
            # Such as a module that cannot be imported there, or processes that die.
            self._job = b""
            self._asked.clear()
            return
        self._ready.extend(zip(prefixes, found, strict=True))

    def _take_answer(self) -> None:
        number, results = self._answered.get()
        if number != BEGIN:
            self._answers[number] = results
        elif results is not None:
            self._is_ready = True
        elif not self._is_ready:
            self._job = b""

    def _send(self) -> None:
        """Ask what `found` wants to know, in a thread of its own, until the end."""
        own: Workers | None = None
        futures: list[Future[Any]] = []
        while (question := self._questions.get()) is not None:
            if self._cluster is None and own is None:
                own = Workers(self._count)
            executor = self._cluster or own
            assert executor is not None
            number, arguments = question
            future = executor.submit(self._runs_of, *arguments)
            future.add_done_callback(partial(self._on_answer, number))
            futures = [one for one in (*futures, future) if not one.done()]
        for future in futures:
            future.cancel()
        if own is not None:
            own.kill()
            own.shutdown()

    def _on_answer(self, number: int, future: Future[list[Found | None] | None]) -> None:
        failed = future.cancelled() or future.exception() is not None
        self._answered.put((number, None if failed else future.result()))


def _pickled(job: tuple[Any, ...]) -> bytes:
    """Return what another process makes the runs of; nothing if that cannot be sent."""
    if isinstance(job[0], Container):
        return b""
    try:
        made = pickle.dumps(job)
    except Exception:  # noqa: BLE001  of any kind: the values' own code decides
        return b""
    return b"" if b"__main__" in made else made
