"""The runs that the home page lists: those of machines that are known, and those in folders."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from smachpy.events.recording import RecordingError, read_recording
from viz.runs.listing import run_row

if TYPE_CHECKING:
    from collections.abc import Iterable

    from viz.live.machines import Machine, Machines

MOST_FILES: Final = 500
"""So many of the newest files of the folders are listed."""

MOST_OPEN: Final = 20
"""So many recordings that were opened from the list stay in memory."""

SAME_NS: Final = 5_000_000
"""Runs of one machine that began within this time are one: a file and what the network told."""

LARGEST: Final = 200_000_000
"""Bytes of a file that is read."""


class Runs:
    """Lists runs and opens recordings.

    Args:
        machines: Those that are known; an opened recording becomes one of them.
        folders: Where recordings are; one that does not exist has none.

    Threads: every method may be called from any thread, and reads files.
    """

    def __init__(self, machines: Machines, folders: Iterable[Path] = ()) -> None:
        self._machines = machines
        self._folders = list(dict.fromkeys(folders))
        self._lock = threading.Lock()
        self._rows: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}
        self._opened: dict[str, None] = {}  # names of machines, in the order of their opening

    def rows(self) -> dict[str, Any]:
        """Return `runs`, newest first, and `folders`.

        A row has what `run_row` says, and `id`; `name` of the machine, null for a file that is not
        open; `live`; `file`, "" for none; `problem`, for a file that cannot be read.
        """
        with self._lock:
            rows = [
                self._row_of(name)
                for name in (one["name"] for one in self._machines.summaries())
                if name not in self._opened
            ]
            files = self._files()
            self._rows = {path: self._rows[path] for path in files if path in self._rows}
            recorded = [self._row_of_file(path) for path in files]
            rows += [row for row in recorded if not any(_is_same(row, one) for one in rows)]
        rows.sort(key=lambda row: (row["live"], row["began"] or 0), reverse=True)
        return {"runs": rows, "folders": [str(folder) for folder in self._folders]}

    def open(self, run: str) -> str:
        """Return the name of the machine that shows a run, which is read if it is a file.

        Args:
            run: The `id` of a row.

        Raises:
            RecordingError: there is no such run, or its file cannot be read.
        """
        kind, _, name = run.partition(" ")
        if kind == "machine" and self._machines.get(name) is not None:
            return name
        path = Path(name)
        with self._lock:
            if kind != "file" or path not in self._files():
                raise RecordingError(name, "no such run in the list; expected one of it.")
            machine = self._machines.obtain(f"run {path.name}")
            if machine.name not in self._opened or machine.file != str(path):
                self._fill(machine, path)
            self._opened.pop(machine.name, None)
            self._opened[machine.name] = None
            while len(self._opened) > MOST_OPEN:
                oldest = next(iter(self._opened))
                del self._opened[oldest]
                self._machines.forget(oldest)
        return machine.name

    def _fill(self, machine: Machine, path: Path) -> None:
        recording = read_recording(path)
        machine.recorded, machine.file = True, str(path)
        machine.reset(recording.history(), limit=len(recording.events) + 1)

    def _files(self) -> list[Path]:
        found: list[tuple[int, Path]] = []
        for folder in self._folders:
            for path in folder.glob("*.jsonl") if folder.is_dir() else ():
                try:
                    found.append((path.stat().st_mtime_ns, path))
                except OSError:  # it has just been removed
                    continue
        return [path for _, path in sorted(found, reverse=True)[:MOST_FILES]]

    def _row_of(self, name: str) -> dict[str, Any]:
        machine = self._machines.get(name)
        assert machine is not None
        assert machine.record is not None
        row = run_row(machine.record, machine.events())
        live = not machine.recorded and machine.stale is None
        return {
            **row,
            "id": f"machine {name}",
            "name": name,
            "live": live and row["outcome"] is None and row["began"] is not None,
            "file": machine.file,
            "problem": "",
        }

    def _row_of_file(self, path: Path) -> dict[str, Any]:
        try:
            facts = path.stat()
            stamp = facts.st_mtime_ns, facts.st_size
        except OSError:
            stamp = (0, 0)
        known = self._rows.get(path)
        if known is None or known[0] != stamp:
            known = self._rows[path] = stamp, _read_row(path, stamp[1])
        return known[1]


def _is_same(file: dict[str, Any], row: dict[str, Any]) -> bool:
    """Tell whether a file holds the run of a machine's row: it was opened, or is being written."""
    if file["file"] == row["file"]:
        return True
    if file["began"] is None or row["began"] is None or file["machine"] != row["machine"]:
        return False
    return bool(abs(file["began"] - row["began"]) < SAME_NS)


def _read_row(path: Path, size: int) -> dict[str, Any]:
    row: dict[str, Any] = {"id": f"file {path}", "name": None, "live": False, "file": str(path)}
    nothing: dict[str, Any] = {
        "machine": path.stem,
        "robots": [],
        "began": None,
        "ended": None,
        "last": None,
    }
    problem = f"got {size} bytes; expected at most {LARGEST}" if size > LARGEST else ""
    if not problem:
        try:
            recording = read_recording(path)
        except RecordingError as error:
            problem = str(error)
        else:
            return {**row, **run_row(recording.record, recording.events), "problem": ""}
    return {**row, **nothing, "outcome": None, "reason": "", "strip": [], "problem": problem}
