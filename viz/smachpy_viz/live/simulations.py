"""Batches of simulated runs, started from the page; each has a process, a folder and a report."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import threading
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from actionlib_core.inputs.checked_data import checked
from actionlib_core.inputs.checked_file import read_limited
from actionlib_core.inputs.json_text import load_json
from actionlib_core.process.private_files import FOLDER, make_private_folder, open_private
from smachpy.command import EXIT_ERROR
from smachpy.command.targets import list_missions
from smachpy.exceptions import SmachError
from smachpy_viz.live.started_commands import (
    STOP_S,
    end_all,
    last_line,
    send_signal,
    start_command,
)
from smachpy_viz.runs.simulate import Vary

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterable

MAX_RUNS: Final = 1_000
MAX_RUNNING_BATCHES: Final = 2
"""Batches that may run at the same time; each of them uses all cores."""

MAX_BATCHES: Final = 50
"""Batches that are listed: the newest ones."""

MAX_VARIED_PARAMETERS: Final = 8
_ID = re.compile(r"[\w-][\w.-]{0,119}", re.ASCII)
_LIMIT = re.compile(r"\d{1,9}(\.\d{1,3})?[smh]?", re.ASCII)
LARGEST_FACTS: Final = 1_000_000
_FACTS = "batch.json"
_ERRORS = "errors.txt"
_REPORT = "report.html"


class SimulationError(SmachError):
    """A batch cannot be started, or does not exist.

    Try: start the batch again; `smachpy simulate` does the same in a terminal.
    """


@dataclass(slots=True)
class Batch:
    """Runs that were started together.

    Attributes:
        id: Name of its folder.
        mission: The mission.
        runs: Number of runs.
        vary: The values that vary, as for `smachpy simulate --vary`.
        seed: As for `smachpy simulate`.
        limit: Virtual time that a run may take, such as "4h".
        compare: Id of the batch to compare with, or "".
        began_ns: When it was started [ns since the epoch].
        outcomes: Outcome -> number of runs.
        failed: Number of runs that raised an exception or did not end.
        first_failure: The reason for the first of these.
        running: Whether it is still running.
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
    """Starts batches and lists them with those of earlier viewers.

    Args:
        folder: The folder of their folders; it need not exist.
        missions: Missions that may be simulated besides the installed ones.

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
        """Return the missions that may be simulated: name -> description."""
        return {**dict.fromkeys(self._own, ""), **list_missions()}

    def rows(self) -> list[dict[str, Any]]:
        """Return the batches, newest first: the fields of `Batch`, and whether it has `report`."""
        with self._lock:
            # Batches of earlier viewers, each read once; this viewer knows its own.
            for path in self._folder.glob(f"*/{_FACTS}") if self._folder.is_dir() else ():
                name = path.parent.name
                if name not in self._batches and (read := _read(path)) is not None:
                    self._batches[name] = read
            found = sorted(self._batches.values(), key=lambda one: one.began_ns, reverse=True)
            return [
                {**asdict(one), "report": (self._folder / one.id / _REPORT).is_file()}
                for one in found[:MAX_BATCHES]
            ]

    def start(self, asked: dict[str, Any]) -> str:
        """Start a batch; return its id.

        Args:
            asked: `mission`, `runs`, `vary` (a list of texts), `seed`, `limit` and `compare`.

        Raises:
            SimulationError: the arguments are invalid, with all problems; or too many batches run.
        """
        batch = self._checked(asked)
        with self._lock:  # held until the process is listed, so that the limit holds
            if sum(one.running for one in self._batches.values()) >= MAX_RUNNING_BATCHES:
                raise SimulationError(
                    f"batches: got {MAX_RUNNING_BATCHES} running ones; expected fewer. "
                    "Stop one, or wait."
                )
            folder = self._folder / batch.id
            try:
                make_private_folder(self._folder)
                folder.mkdir(FOLDER)
                _write(folder, batch)
                errors = open_private(folder / _ERRORS, "w")
            except OSError as error:
                raise SimulationError(f"{str(folder)!r}: {error.strerror or error}.") from error
            with errors:
                process = start_command(self._words(batch, folder), errors)
            self._batches[batch.id] = batch
            self._processes[batch.id] = process
        self._tasks.append(
            self._clock.spawn(lambda: self._follow(batch, process, folder), name=f"runs {batch.id}")
        )
        return batch.id

    def stop(self, name: object) -> None:
        """Interrupt a batch as Ctrl-C does, and kill it after `STOP_S`; finished runs remain.

        Raises:
            SimulationError: there is no running batch of that name.
        """
        with self._lock:
            process = self._processes.get(name) if isinstance(name, str) else None
            if process is None:
                raise SimulationError(f"batch: got {name!r}; expected a running one.")
            self._stopped.add(str(name))
        send_signal(process, signal.SIGINT)
        self._clock.call_later(STOP_S, lambda: self._kill(name, process))

    def report(self, name: str) -> bytes:
        """Return the report of a batch, an HTML page.

        Raises:
            SimulationError: there is no such batch, or it has no report.
        """
        path = self._folder / name / _REPORT
        # The pattern has no "/" and no "..": a name cannot lead out of the folder.
        if not _ID.fullmatch(name) or not path.is_file():
            raise SimulationError(f"batch: got {name!r}; expected one that has a report.")
        return path.read_bytes()

    def close(self) -> None:
        """End all running batches.

        Blocks: until they have ended, a few seconds at most.
        """
        with self._lock:
            processes, tasks = list(self._processes.values()), list(self._tasks)
        end_all(processes)
        for task in tasks:
            task.join(STOP_S)

    # -- parts -----------------------------------------------------------------------------------

    def _kill(self, name: object, process: subprocess.Popen[str]) -> None:
        """Kill a process that is still running.

        Python drops the KeyboardInterrupt if it is raised in a destructor or C callback.
        """
        with self._lock:
            if self._processes.get(str(name)) is process:
                send_signal(process, signal.SIGKILL)

    def _checked(self, asked: dict[str, Any]) -> Batch:
        """Return the batch that a page asks for; the page's data may be of any type."""
        problems = []
        mission, runs, seed = asked.get("mission"), asked.get("runs"), asked.get("seed", 1)
        vary, limit = asked.get("vary", []), asked.get("limit") or "4h"
        compare = asked.get("compare") or ""
        if not isinstance(mission, str) or mission not in self.missions():
            known = ", ".join(self.missions())
            problems.append(f"mission: got {mission!r}; expected one of {known}.")
        if type(runs) is not int or not 1 <= runs <= MAX_RUNS:
            problems.append(f"runs: got {runs!r}; expected 1 to {MAX_RUNS}.")
        if type(seed) is not int or abs(seed) > 2**31:
            problems.append(f"seed: got {seed!r}; expected a whole number.")
        if not isinstance(limit, str) or not _LIMIT.fullmatch(limit):
            problems.append(f"limit: got {limit!r}; expected a time such as 30s, 10m or 2h.")
        if not isinstance(vary, list) or len(vary) > MAX_VARIED_PARAMETERS:
            problems.append(
                f"vary: got {vary!r:.80}; expected a list of {MAX_VARIED_PARAMETERS} at most."
            )
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
        # Like all names in the folder, it matches _ID; the time makes it unique.
        now = self._clock.time_ns()
        word = re.sub(r"[^A-Za-z0-9_]", "_", Path(str(mission)).stem)[:60]
        return Batch(
            f"{word}-{now // 1_000_000}", str(mission), int(str(runs)), [str(v) for v in vary],
            int(str(seed)), str(limit), str(compare), now,
        )  # fmt: skip

    def _words(self, batch: Batch, folder: Path) -> list[str]:
        words = ["simulate", batch.mission, "--runs", str(batch.runs), "--seed", str(batch.seed)]
        words += ["--limit", batch.limit, "--record", str(folder / "runs"), "--json"]
        # With "=", a text that begins with a dash cannot be taken for an option.
        words += [f"--vary={one}" for one in batch.vary]
        words += ["--compare", str(self._folder / batch.compare / "runs")] if batch.compare else []
        return [*words, "-o", str(folder / _REPORT)]

    def _follow(self, batch: Batch, process: subprocess.Popen[str], folder: Path) -> None:
        """Count the runs of a batch until it ends."""
        assert process.stdout is not None
        with process.stdout:
            for line in process.stdout:
                with contextlib.suppress(ValueError):  # a line that a mission printed
                    self._count(batch, json.loads(line))
        code = process.wait()
        with self._lock:
            self._processes.pop(batch.id, None)
            batch.running = False
            if not (folder / _REPORT).is_file():
                # The exit code alone is ambiguous: an interrupt while Python starts gives 1.
                stopped = batch.id in self._stopped or code not in {0, 1, EXIT_ERROR}
                batch.problem = "it was stopped" if stopped else last_line(folder / _ERRORS)
            with contextlib.suppress(OSError):
                _write(folder, batch)

    def _count(self, batch: Batch, run: Any) -> None:
        outcome = run.get("outcome") if isinstance(run, dict) else None
        with self._lock:
            if isinstance(outcome, str):
                batch.outcomes[outcome] = batch.outcomes.get(outcome, 0) + 1
                return
            batch.failed += 1
            batch.first_failure = batch.first_failure or f"run {run['run']}: {run['error']}"


def _write(folder: Path, batch: Batch) -> None:
    with open_private(folder / _FACTS, "w") as file:
        json.dump(asdict(batch), file)


def _read(path: Path) -> Batch | None:
    """Read a batch of an earlier viewer; it cannot be running any more."""
    try:
        batch: Batch = checked(Batch, load_json(read_limited(path, LARGEST_FACTS)))
    except (OSError, ValueError):
        return None
    if batch.id != path.parent.name:  # copied
        return None
    if batch.running:
        batch.running, batch.problem = False, "the viewer ended before the batch"
    return batch
