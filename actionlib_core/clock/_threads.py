"""Threads that are used again: starting one costs a lock hand-over instead of a thread."""

from __future__ import annotations

import _thread
import threading
from typing import Protocol

IDLE_S = 5.0  # a cached thread without work ends after this
IDLE_NAME = "idle"  # what a cached thread is called between two jobs


class Job(Protocol):
    """What a cached thread runs."""

    name: str

    def run(self) -> None:
        """Do the work; lets nothing through and ends with `mark_idle`."""
        ...


def mark_idle() -> None:
    """Call this thread idle, before anybody hears that its job has ended."""
    threading.current_thread().name = IDLE_NAME


class _Worker:
    """One cached thread: runs tasks handed to it, ends after `IDLE_S` without any."""

    def __init__(self, cache: ThreadCache) -> None:
        self._cache = cache
        self._wake = _thread.allocate_lock()
        self._wake.acquire()
        self._task: Job | None = None
        self._thread = threading.Thread(target=self._run, name=IDLE_NAME, daemon=True)
        self._started = False

    def give(self, task: Job | None) -> None:
        """Run `task`; None only starts the thread."""
        self._task = task
        if self._started:
            self._wake.release()
        else:
            self._started = True
            self._thread.start()

    def _run(self) -> None:
        while True:
            task, self._task = self._task, None
            if task is not None:
                self._thread.name = task.name
                task.run()
            del task
            self._cache.put_back(self)
            if not self._wake.acquire(timeout=IDLE_S):
                if self._cache.retire(self):
                    return
                self._wake.acquire()  # kept, or `give` chose this worker at the last moment


class ThreadCache:
    """Idle threads, newest first; starting one from here costs a lock hand-over.

    No lock: list operations are atomic, and a signal handler may need a thread at any moment.
    """

    def __init__(self) -> None:
        self._idle: list[_Worker] = []
        self._late: list[Job] = []  # what waits for a thread, as no more can be started
        self._kept = 0

    def start(self, task: Job) -> None:
        try:
            worker = self._idle.pop()
        except IndexError:
            worker = _Worker(self)
        try:
            worker.give(task)
        except RuntimeError:
            if threading.main_thread().is_alive() or not self._kept:
                raise
            self._late.append(task)
            self._start_late()

    def keep(self, count: int) -> None:
        """Have `count` threads for what runs while the program ends.

        Python 3.12 starts no thread then: jobs wait until one of these is free.
        """
        self._kept = max(self._kept, count)
        for _ in range(count - len(self._idle)):
            _Worker(self).give(None)

    def put_back(self, worker: _Worker) -> None:
        self._idle.append(worker)
        self._start_late()

    def retire(self, worker: _Worker) -> bool:
        if len(self._idle) <= self._kept:
            return False
        try:
            self._idle.remove(worker)
        except ValueError:
            return False
        return True

    def _start_late(self) -> None:
        while self._late and self._idle:
            try:
                worker = self._idle.pop()
            except IndexError:  # another thread took it; it comes here when it is free again
                return
            try:
                task = self._late.pop(0)
            except IndexError:
                self._idle.append(worker)
            else:
                worker.give(task)
