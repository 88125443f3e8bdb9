"""Tasks at the workers of a Dask scheduler; the only module that imports `distributed`.

On each worker's computer every task runs in a process of its own (`smachpy.base.workers`), beside
the worker: missions need the main thread of a process, and a worker has several threads.
"""

from __future__ import annotations

import contextlib
import pickle
import re
import threading
import uuid
from concurrent.futures import CancelledError, Executor, Future
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from smachpy.base.workers import Workers
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

ADDRESS: Final = re.compile(r"(tcp|tls)://[^/\s]+:\d{1,5}")
"""The form of an address."""

CONNECT_S: Final = 10.0
"""Longest wait for the scheduler [s]."""

FACTS_S: Final = 120.0
"""Longest wait for what the workers say about themselves [s]."""

MOST: Final = 3
"""Differences of a worker that are said."""


class ClusterError(SmachError):
    """There is no scheduler, or no worker of it can be used.

    Try: `dask scheduler` and `dask worker` with the same Python, smachpy and mission as here.
    """


class Cluster(Executor):
    """Does tasks at those workers of a scheduler that have the code of this computer.

    Workers that come later are not used. A worker that dies costs its tasks again.

    Args:
        address: Of the scheduler: "tcp://HOST:8786".
        facts: A function that is called here and at each worker; its dicts must be equal.
        given: Its arguments.
        say: Gets a line about each worker that is refused.

    Attributes:
        count: Number of tasks at the same time.
        workers: Number of workers that are used.

    Raises:
        ClusterError: the address has another form, or nobody answers, or all workers are refused.
        ImportError: `distributed` is not installed.

    Blocks: until all workers have answered, `CONNECT_S` and `FACTS_S` at most.
    """

    def __init__(
        self,
        address: str,
        facts: Callable[..., Mapping[str, str]],
        given: tuple[Any, ...],
        say: Callable[[str], object],
    ) -> None:
        if ADDRESS.fullmatch(address) is None:
            raise ClusterError(f"--on: got {address!r}; expected tcp://HOST:PORT.")
        from distributed import Client

        make: Any = Client
        self._address = address
        self._session = uuid.uuid4().hex
        self._lock = threading.Lock()
        self._pending: dict[Future[Any], Future[Any]] = {}  # by that of the client
        self._lost = ""
        mine = facts(*given)
        try:
            self._client: Any = make(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:  # a TimeoutError is an OSError
            raise ClusterError(
                f"--on {address}: no scheduler answers ({type(error).__name__}); expected one. "
                "Try 'dask scheduler', and its address."
            ) from error
        self._executor: Any = self._client.get_executor()
        self._threads: dict[str, int] = {}
        try:
            self._admit(facts, given, mine, say)
            self._client.subscribe_topic("all", self._on_event)
        except BaseException:
            self.shutdown(cancel_futures=True)
            raise
        self.count = sum(self._threads.values())
        self.workers = len(self._threads)

    def _admit(
        self,
        facts: Callable[..., Mapping[str, str]],
        given: tuple[Any, ...],
        mine: Mapping[str, str],
        say: Callable[[str], object],
    ) -> None:
        """Ask all workers what they have, and take those that have the same."""
        workers = self._client.scheduler_info(n_workers=-1)["workers"]
        payload = pickle.dumps((facts, given, {}))
        asked = {
            name: self._client.submit(
                do, self._session, one["nthreads"], payload, workers=[name], pure=False
            )
            for name, one in workers.items()
        }
        clock = RealClock()
        until = clock.now() + FACTS_S
        for name, future in asked.items():
            why = _differences(future, mine, max(0.0, until - clock.now()))
            if why:
                say(f"worker {name}: not used: {why}")
                future.cancel()
            else:
                self._threads[name] = workers[name]["nthreads"]
        if not self._threads:
            raise ClusterError(
                f"--on {self._address}: got {len(asked)} workers, none of which can be used; "
                "expected one with the Python, the packages and the mission of this computer."
            )

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The function and its arguments are pickled."""
        future: Future[Any] = Future()
        payload = pickle.dumps((fn, args, kwargs))
        with self._lock:
            names, lost = list(self._threads), self._lost
            if not lost:
                most = max(self._threads.values())  # each does as many at once as it has threads
                theirs = self._executor.submit(
                    do, self._session, most, payload, workers=names, pure=False
                )
                self._pending[theirs] = future
        if lost:
            future.set_exception(ClusterError(lost))
        else:
            theirs.add_done_callback(self._on_done)  # in a thread of the client
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes of this program at the workers, and leave the scheduler.

        Blocks: until the workers have done so; for a worker that does not answer, Dask's timeout.
        """
        del wait, cancel_futures  # whoever is through needs no more results
        with self._lock:
            self._lost = self._lost or "the program ends"
        self._executor.shutdown(wait=False)  # takes back what has not begun
        # If the scheduler or a worker is gone, so are its processes.
        with contextlib.suppress(OSError, CancelledError):
            self._client.run(end, self._session, workers=list(self._threads), on_error="ignore")
        self._client.close()

    def _on_done(self, theirs: Future[tuple[str, Any]]) -> None:
        with self._lock:
            future = self._pending.pop(theirs, None)
        if future is None or not future.set_running_or_notify_cancel():
            return
        if theirs.cancelled() or theirs.exception() is not None:
            why = "" if theirs.cancelled() else _line(theirs.exception())
            future.set_exception(ClusterError(self._lost or why or "the scheduler is gone"))
            return
        what, value = theirs.result()
        if what == "done":
            future.set_result(pickle.loads(value))  # noqa: S301  of a worker, as the code it runs
        else:
            future.set_exception(RuntimeError(value))

    def _on_event(self, event: tuple[float, Any]) -> None:
        """Note that a worker is gone; if it was the last, nobody would do its tasks."""
        facts = event[1]
        if not isinstance(facts, dict) or facts.get("action") != "remove-worker":
            return
        failed: list[Future[Any]] = []
        with self._lock:
            self._threads.pop(facts.get("worker", ""), None)
            if not (self._threads or self._lost):
                self._lost = f"--on {self._address}: no worker is left; expected one."
                failed = list(self._pending.values())
                self._pending.clear()
        for future in failed:
            if future.set_running_or_notify_cancel():
                future.set_exception(ClusterError(self._lost))


def _differences(future: Any, mine: Mapping[str, str], seconds: float) -> str:
    """Return why a worker is not used, from its answer within so many seconds; "" if it is."""
    try:
        error = future.exception(timeout=seconds)
    except TimeoutError:
        return f"got no answer in {FACTS_S:g} s"
    except CancelledError:
        return "it is gone"
    if error is not None:
        return _line(error)
    what, value = future.result()
    if what != "done":
        return str(value)
    theirs = pickle.loads(value)  # noqa: S301  of a worker, as the code it runs
    found = [
        f"got {name} {theirs.get(name, 'missing')}; expected {text}"
        for name, text in mine.items()
        if theirs.get(name) != text
    ]
    rest = f", and {len(found) - MOST} more" if len(found) > MOST else ""
    return ", ".join(found[:MOST]) + rest


def _line(error: BaseException | None) -> str:
    return "" if error is None else f"{type(error).__name__}: {error}".partition("\n")[0]


# -- at a worker -----------------------------------------------------------------------------------

_LOCK = threading.Lock()
_sessions: dict[str, tuple[Workers, list[object]]] = {}  # its processes, and its running tasks
_ended: set[str] = set()


def do(session: str, count: int, payload: bytes) -> tuple[str, Any]:
    """Do a task in a process beside this one.

    Args:
        session: The program that asks.
        count: The most processes of that program here.
        payload: The pickled function, its arguments and its named ones.

    Returns:
        "done" and the pickled result, or "failed" and the error in words.

    Blocks: until it is done.
    """
    with _LOCK:
        if session in _ended:
            return "failed", "the program has ended"
        if session not in _sessions:
            # Those of programs that have died without a word have nothing to do, ever again.
            for other in [name for name, (_, tasks) in _sessions.items() if not tasks]:
                _sessions.pop(other)[0].shutdown(wait=False)
            _sessions[session] = Workers(count), []
        workers, tasks = _sessions[session]
        tasks.append(payload)
    try:
        return "done", workers.submit(_perform, payload).result()
    except Exception as error:  # noqa: BLE001  whatever the task did is its result
        return "failed", str(error)
    finally:
        with _LOCK:
            tasks.remove(payload)


def _perform(payload: bytes) -> bytes:
    function, args, named = pickle.loads(payload)  # noqa: S301  of the program that this worker serves
    return pickle.dumps(function(*args, **named))


def end(session: str) -> None:
    """Kill the processes of a program; it begins no more."""
    with _LOCK:
        _ended.add(session)
        found = _sessions.pop(session, None)
    if found is not None:
        found[0].shutdown(wait=False, cancel_futures=True)
        found[0].kill()
