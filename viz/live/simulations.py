"""Many simulated runs that the page starts: each batch is a process, a folder and a report."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from smachpy.command.targets import list_missions
from smachpy.exceptions import SmachError
from viz.runs.simulate import Vary

if TYPE_CHECKING:
    from collections.abc import Iterable

MOST_RUNS: Final = 1_000
MOST_RUNNING: Final = 2
"""So many batches run at the same time; each takes all cores."""

MOST_BATCHES: Final = 50
MOST_VARIED: Final = 8
STOP_S: Final = 5.0
EXIT_BAD_INPUT: Final = 2

_ID = re.compile(r"[\w.-]{1,120}", re.ASCII)
_LIMIT = re.compile(r"\d{1,9}(\.\d{1,3})?[smh]?", re.ASCII)
_FACTS = "batch.json"


class SimulationError(SmachError):
    """Runs cannot be started, or there are none of that name."""


@dataclass(slots=True)
class Batch:
    """Runs that were started together.

    Attributes:
        id: Its folder's name.
        mission: What is simulated.
        runs: How many.
        vary: What varies, as `smachpy simulate --vary` takes it.
        seed: See `smachpy simulate`.
        limit: Virtual time that a run may take: "4h".
        compare: Id of the batch that it is compared with, or "".
        began_ns: When it was started [ns since the epoch].
        outcomes: How runs have ended -> how many.
        failed: So many raised, or did not end.
        first_failure: Why, of the first of them.
        running: Whether it goes on.
        problem: Why there is no report, or "".
    """

    id: str
    mission: str
    runs: int
    vary: list[str]
    seed: int
    limit: str
    compare: str
    began_ns: int
    outcomes: dict[str, int] = field(default_factory=dict)
    failed: int = 0
    first_failure: str = ""
    running: bool = True
    problem: str = ""


class Simulations:
    """Starts batches and tells how they stand; those of earlier viewers too.

    Args:
        folder: Where their folders are; it need not exist.
        missions: What may be simulated besides the installed missions.

    Threads: every method may be called from any thread; `start` and `rows` read files.
    """

    def __init__(self, folder: Path, missions: Iterable[str] = ()) -> None:
        self._folder = folder
        self._own = list(missions)
        self._clock = RealClock()
        self._lock = threading.Lock()
        self._batches: dict[str, Batch] = {}
        self._processes: dict[str, subprocess.Popen[str]] = {}
        self._stopped: set[str] = set()
        self._tasks: list[Any] = []

    def missions(self) -> dict[str, str]:
        """Return what may be simulated, name -> what it does."""
        return {**dict.fromkeys(self._own, ""), **list_missions()}

    def rows(self) -> list[dict[str, Any]]:
        """Return all batches, the newest first: `Batch`, and `report`, whether there is one."""
        with self._lock:
            for path in self._folder.glob(f"*/{_FACTS}") if self._folder.is_dir() else ():
                name = path.parent.name
                if name not in self._batches and (read := _read(path)) is not None:
                    self._batches[name] = read
            found = sorted(self._batches.values(), key=lambda one: one.began_ns, reverse=True)
            return [
                {**asdict(one), "report": (self._folder / one.id / "report.html").is_file()}
                for one in found[:MOST_BATCHES]
            ]

    def start(self, asked: dict[str, Any]) -> str:
        """Start a batch; return its id.

        Args:
            asked: `mission`, `runs`, `vary` (a list of texts), `seed`, `limit` and `compare`.

        Raises:
            SimulationError: that makes no sense, with all problems; or too many run already.
        """
        batch = self._checked(asked)
        with self._lock:
            if sum(one.running for one in self._batches.values()) >= MOST_RUNNING:
                raise SimulationError(f"{MOST_RUNNING} batches run already; expected fewer.")
            folder = self._folder / batch.id
            try:
                folder.mkdir(parents=True)
                _write(folder, batch)
                said = (folder / "said.txt").open("w", encoding="utf-8")
            except OSError as error:
                raise SimulationError(f"{str(folder)!r}: {error.strerror or error}.") from error
            with said:
                process = subprocess.Popen(  # noqa: S603  our own command
                    [sys.executable, "-m", "smachpy.command", *self._words(batch, folder)],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=said,
                    start_new_session=True,  # its group: the command and its processes
                    text=True,
                    encoding="utf-8",
                    errors="replace",
                )
            self._batches[batch.id] = batch
            self._processes[batch.id] = process
        self._tasks.append(
            self._clock.spawn(lambda: self._follow(batch, process, folder), name=f"runs {batch.id}")
        )
        return batch.id

    def stop(self, name: object) -> None:
        """End a batch that runs, as Ctrl-C does; it is killed after `STOP_S`. What is done is left.

        Raises:
            SimulationError: there is none of that name that runs.
        """
        with self._lock:
            process = self._processes.get(name) if isinstance(name, str) else None
            if process is None:
                raise SimulationError(f"batch: got {name!r}; expected one that runs.")
            self._stopped.add(str(name))
        _signal(process, signal.SIGINT)
        self._clock.call_later(STOP_S, lambda: self._kill(name, process))

    def report(self, name: str) -> bytes:
        """Return the report of a batch, a page.

        Raises:
            SimulationError: there is none.
        """
        path = self._folder / name / "report.html"
        if not _ID.fullmatch(name) or not path.is_file():
            raise SimulationError(f"batch: got {name!r}; expected one that has a report.")
        return path.read_bytes()

    def close(self) -> None:
        """End what runs.

        Blocks: until it has ended, some seconds at most.
        """
        with self._lock:
            processes, tasks = list(self._processes.values()), list(self._tasks)
        for process in processes:
            _signal(process, signal.SIGINT)
        for process in processes:
            try:
                process.wait(STOP_S)
            except subprocess.TimeoutExpired:
                _signal(process, signal.SIGKILL)
        for task in tasks:
            task.join(STOP_S)

    # -- parts -----------------------------------------------------------------------------------

    def _kill(self, name: object, process: subprocess.Popen[str]) -> None:
        """Kill a process that goes on: Python loses an interrupt in a destructor or callback."""
        with self._lock:
            if self._processes.get(str(name)) is process:
                _signal(process, signal.SIGKILL)

    def _checked(self, asked: dict[str, Any]) -> Batch:
        problems = []
        mission, runs, seed = asked.get("mission"), asked.get("runs"), asked.get("seed", 1)
        vary, limit = asked.get("vary", []), asked.get("limit") or "4h"
        compare = asked.get("compare") or ""
        if not isinstance(mission, str) or mission not in self.missions():
            known = ", ".join(self.missions())
            problems.append(f"mission: got {mission!r}; expected one of {known}.")
        if type(runs) is not int or not 1 <= runs <= MOST_RUNS:
            problems.append(f"runs: got {runs!r}; expected 1 to {MOST_RUNS}.")
        if type(seed) is not int or abs(seed) > 2**31:
            problems.append(f"seed: got {seed!r}; expected a whole number.")
        if not isinstance(limit, str) or not _LIMIT.fullmatch(limit):
            problems.append(f"limit: got {limit!r}; expected a time such as 30s, 10m or 2h.")
        if not isinstance(vary, list) or len(vary) > MOST_VARIED:
            problems.append(f"vary: got {vary!r:.80}; expected a list of {MOST_VARIED} at most.")
            vary = []
        for one in vary:
            try:
                Vary.read(str(one))
            except ValueError as error:
                problems.append(f"vary: {error}")
        folder = self._folder / str(compare) / "runs"
        if compare and not (_ID.fullmatch(str(compare)) and folder.is_dir()):
            problems.append(f"compare: got {compare!r}; expected an earlier batch.")
        if problems:
            raise SimulationError("\n".join(problems))
        now = self._clock.time_ns()
        word = re.sub(r"[^A-Za-z0-9_]", "_", Path(str(mission)).stem)[:60]
        return Batch(
            f"{word}-{now // 1_000_000}", str(mission), int(str(runs)), [str(v) for v in vary],
            int(str(seed)), str(limit), str(compare), now,
        )  # fmt: skip

    def _words(self, batch: Batch, folder: Path) -> list[str]:
        words = ["simulate", batch.mission, "--runs", str(batch.runs), "--seed", str(batch.seed)]
        words += ["--limit", batch.limit, "--record", str(folder / "runs"), "--json"]
        words += [word for one in batch.vary for word in ("--vary", one)]
        words += ["--compare", str(self._folder / batch.compare / "runs")] if batch.compare else []
        return [*words, "-o", str(folder / "report.html")]

    def _follow(self, batch: Batch, process: subprocess.Popen[str], folder: Path) -> None:
        """Count the runs of a batch until it ends."""
        assert process.stdout is not None
        with process.stdout:
            for line in process.stdout:
                with contextlib.suppress(ValueError):
                    self._count(batch, json.loads(line))
        code = process.wait()
        with self._lock:
            self._processes.pop(batch.id, None)
            batch.running = False
            if not (folder / "report.html").is_file():
                # The code alone does not tell: 1 where the interrupt comes while Python starts.
                stopped = batch.id in self._stopped or code not in {0, 1, EXIT_BAD_INPUT}
                batch.problem = "it was stopped" if stopped else _last_line(folder / "said.txt")
            with contextlib.suppress(OSError):
                _write(folder, batch)

    def _count(self, batch: Batch, told: Any) -> None:
        outcome = told.get("outcome") if isinstance(told, dict) else None
        with self._lock:
            if isinstance(outcome, str):
                batch.outcomes[outcome] = batch.outcomes.get(outcome, 0) + 1
                return
            batch.failed += 1
            batch.first_failure = batch.first_failure or f"run {told['run']}: {told['error']}"


def _signal(process: subprocess.Popen[str], number: int) -> None:
    """Send a signal to a process that leads a group, and to its group."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)


def _write(folder: Path, batch: Batch) -> None:
    (folder / _FACTS).write_text(json.dumps(asdict(batch)), encoding="utf-8")


def _read(path: Path) -> Batch | None:
    """Read a batch of an earlier viewer; one that ran then runs no more."""
    try:
        batch = Batch(**json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    if batch.id != path.parent.name or type(batch.began_ns) is not int:
        return None
    if batch.running:
        batch.running, batch.problem = False, "the viewer ended before it"
    return batch


def _last_line(path: Path) -> str:
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    except OSError:
        return "it ended without a word"
    said = [line for line in lines if line.strip()]
    return said[-1].removeprefix("smachpy: ") if said else "it ended without a word"
