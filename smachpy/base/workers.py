"""Processes that do one task after another; one that dies takes only its task with it.

`concurrent.futures.ProcessPoolExecutor` gives all tasks up when one of its processes dies, and its
processes import from the current folder before anything else.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future
from multiprocessing.connection import Connection, Pipe
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from actionlib_core.shutdown.child_process import python_command
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_TRIES: Final = 3
"""A task whose process dies is done again, so often in all."""

END_S: Final = 5.0
"""Longest wait for a process that has nothing more to do; then it is killed [s]."""


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerError(SmachError):
    """The processes that did a task died, one after the other.

    Try: run it again; a killed process often means too little memory: use fewer `--jobs`.

    Attributes:
        code: Its exit code; the negative number of the signal that has killed it.
    """

    def __init__(self, code: int) -> None:
        self.code = code
        names = {number.value: number.name for number in signal.Signals}
        how = f"exit code {code}" if code >= 0 else f"signal {names.get(-code, -code)}"
        super().__init__(f"its process died {MOST_TRIES} times: {how}")


class Workers(Executor):
    """Starts up to `count` processes, which Ctrl-C in the terminal does not reach.

    A process that dies, such as for lack of memory, costs its task `MOST_TRIES` tries at most. The
    processes have the present `sys.path`; they end when this process ends.
    """

    def __init__(self, count: int) -> None:
        self._clock = RealClock()
        self._waiting: SimpleQueue[tuple[Future[Any], Any] | None] = SimpleQueue()
        self._processes: set[WorkerProcess] = set()
        self._killed = False
        self._threads = [
            self._clock.spawn(self._work, name=f"worker {number}") for number in range(count)
        ]

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The function and its arguments are pickled."""
        future: Future[Any] = Future()
        self._waiting.put((future, (fn, args, kwargs)))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        while cancel_futures and not self._waiting.empty():
            item = self._waiting.get()
            if item is not None:
                item[0].cancel()
        for _ in self._threads:
            self._waiting.put(None)
        for thread in self._threads if wait else ():
            thread.join()

    def kill(self) -> None:
        """Kill the processes, because a task may never end."""
        self._killed = True
        for process in self._processes.copy():
            process.kill()

    def _work(self) -> None:
        process: WorkerProcess | None = None
        while (item := self._waiting.get()) is not None:
            future, task = item
            if future.set_running_or_notify_cancel():
                process = self._do(future, task, process)
        if process is not None:
            self._processes.discard(process)
            process.end()

    def _do(
        self, future: Future[Any], task: Any, process: WorkerProcess | None
    ) -> WorkerProcess | None:
        """Do a task, in another process if one dies; return the process that lives."""
        for tries_left in reversed(range(MOST_TRIES)):
            try:
                if process is None:
                    process = WorkerProcess()
                    self._processes.add(process)
                    if self._killed:
                        process.kill()
                process.connection.send(task)
                result, error = process.connection.recv()
            except (EOFError, ConnectionError):
                assert process is not None
                self._processes.discard(process)
                code, process = process.end(), None
                if self._killed or not tries_left:
                    future.set_exception(WorkerError(code))
                    break
            except Exception as problem:  # noqa: BLE001  for example, no process can be started
                future.set_exception(problem)
                break
            else:
                if error is None:
                    future.set_result(result)
                else:
                    future.set_exception(error)
                break
        return process


class WorkerProcess:
    """One process, and the connection to it."""

    def __init__(self) -> None:
        self.connection, theirs = Pipe()
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603  our own interpreter and module
                python_command("-m", __name__, str(theirs.fileno())),
                stdin=subprocess.PIPE,  # closed however this process ends
                stdout=subprocess.DEVNULL,
                pass_fds=[theirs.fileno()],
                start_new_session=True,
            )
        try:
            self.connection.send(sys.path)
        except ConnectionError:  # reported as the end of its first task
            return

    def kill(self) -> None:
        """End it at once."""
        self._process.kill()

    def end(self) -> int:
        """End it; return its exit code."""
        self.connection.close()
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            return self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()


def serve(connection: Connection) -> None:
    """Do the tasks that come over a connection until it is closed.

    Blocks: until then.
    """
    while True:
        result, failure = None, None
        try:
            try:
                function, arguments, named = connection.recv()
            except EOFError:
                return
            result = function(*arguments, **named)
        except BaseException as error:  # noqa: BLE001  also `sys.exit` is the end of the task only
            # Exceptions of a mission need not survive pickling.
            failure = RuntimeError(f"{type(error).__name__}: {error}")
        try:
            connection.send((result, failure))
        except Exception as error:  # noqa: BLE001  of any kind: the result's own code decides
            connection.send((None, RuntimeError(f"{type(error).__name__}: {error}")))


def _end_with_parent() -> None:
    """End this process when its standard input is closed: by the parent's end."""
    while os.read(0, 4096):
        pass
    os._exit(1)  # a task may never end


def main() -> None:
    """Serve over the connection whose file number is the argument."""
    with Connection(int(sys.argv[1])) as connection:
        sys.path[:] = connection.recv()
        RealClock().spawn(_end_with_parent, name="end with parent")
        serve(connection)


if __name__ == "__main__":
    main()
