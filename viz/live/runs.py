"""The runs that the home page lists: those of machines that are known, and those in folders."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from smachpy.events.recording import RecordingError, read_recording
from smachpy.exceptions import MissionError
from viz.runs.listing import run_row

if TYPE_CHECKING:
    from collections.abc import Iterable

    from viz.live.journals import Journals
    from viz.live.machines import Machine, Machines

MOST_FILES: Final = 500
"""So many of the newest files of the folders are listed."""

MOST_OPEN: Final = 20
"""So many recordings that were opened from the list stay in memory."""

DAY_NS: Final = 86_400_000_000_000
"""A clock that is further behind is that of a mission in virtual time."""

MOST_IN_FLEET: Final = 32
"""So many live runs are shown together, each with so many of its newest poses and goals' events."""

MOST_POSES: Final = 200
MOST_GOALS: Final = 100

SAME_NS: Final = 5_000_000
"""Runs of one machine that began within this time are one: a file and what the network told."""

LARGEST: Final = 200_000_000
"""Bytes of a file that is read."""


class Runs:
    """Lists runs and opens recordings.

    Args:
        machines: Those that are known; an opened recording becomes one of them.
        folders: Where recordings are; one that does not exist has none.
        journals: Durable missions; None lists none.

    Threads: every method may be called from any thread, and reads files.
    """

    def __init__(
        self,
        machines: Machines,
        folders: Iterable[Path] = (),
        journals: Journals | None = None,
    ) -> None:
        self._machines = machines
        self._journals = journals
        self._folders = list(dict.fromkeys(folders))
        self._lock = threading.Lock()
        self._rows: dict[Path, tuple[tuple[int, int], dict[str, Any]]] = {}
        self._opened: dict[str, None] = {}  # names of machines, in the order of their opening

    def rows(self) -> dict[str, Any]:
        """Return `runs`, newest first, `folders`, and `journals`, see `Journals.places`.

        A row has what `run_row` says, and `id`; `name` of the machine, null for a file that is not
        open; `live`; `file`, "" for none; `problem`, for a file that cannot be read; `run`, which
        names the run of a durable mission, else ""; `stamp`, `began` by the mission's own time,
        which may have been virtual; `asks`, whether a person is asked; `mission`,
        null or what `Journals.rows` says of it. A run that is on the network, in files and in a
        journal is one row.
        """
        missions = [] if self._journals is None else self._journals.rows()
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
            rows = with_missions(rows, missions)
        rows.sort(key=lambda row: (row["live"], row["began"] or 0), reverse=True)
        return {
            "runs": rows,
            "folders": [str(folder) for folder in self._folders],
            "journals": [] if self._journals is None else self._journals.places(),
        }

    def fleet(self) -> list[dict[str, Any]]:
        """Return the live runs as rows, with what a map of all needs: `observed` and `events`.

        `observed` are the newest map and poses that the robot's topics told; `events` the newest
        about goals. Those of files and of machines that are gone are left out.
        """
        names = [
            one["name"]
            for one in self._machines.summaries()
            if one["stale"] is None and not one["recorded"]
        ]
        found = []
        for name in names[:MOST_IN_FLEET]:
            machine = self._machines.get(name)
            if machine is None or not (row := self._row_of(name))["live"]:
                continue
            seen = machine.observed()
            maps = [one for one in seen if one["what"] == "map"][-1:]
            poses = [one for one in seen if one["what"] == "pose"][-MOST_POSES:]
            goals = [one for one in machine.events() if one["kind"].startswith("Goal")]
            found.append({**row, "observed": maps + poses, "events": goals[-MOST_GOALS:]})
        return found

    def command(self, mission: dict[str, Any]) -> str:
        """Resume or cancel a durable mission; return what happens now, in words.

        Args:
            mission: `journal`, `id` and `command`, texts.

        Raises:
            SmachError: that is not what was given, or see `Journals.command`.
        """
        words = [mission.get(name) for name in ("journal", "id", "command")]
        if self._journals is None or not all(isinstance(word, str) for word in words):
            raise MissionError(
                f"mission: got {sorted(mission)}; expected the texts journal, id and command of a "
                "mission that is listed."
            )
        journal, name, command = map(str, words)
        listed = self.rows()["runs"]
        file = next((one["file"] for one in listed if _is_mission(one, journal, name)), "")
        return self._journals.command(journal, name, command, file)

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
        machine.date_shift = recording.made_ns - recording.stamp_ns
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
        behind = machine.behind or 0
        virtual = machine.date_shift or (behind if abs(behind) > DAY_NS else 0)
        return {
            **_dated(row, virtual),
            "id": f"machine {name}",
            "name": name,
            "live": live and row["outcome"] is None and row["began"] is not None,
            "file": machine.file,
            "problem": "",
            "run": machine.run,
            "asks": live and bool(machine.questions()),
            "mission": None,
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


def with_missions(
    rows: list[dict[str, Any]], missions: Iterable[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return runs with the missions that they are of, and those missions that have no other row."""
    of_run = {one["run"]: one for one in missions}
    joined: dict[str, dict[str, Any]] = {}
    found = []
    for row in rows:
        mission = of_run.get(row["run"]) if row["run"] else None
        if mission is None:
            found.append(row)
        elif row["run"] not in joined:
            known = joined[row["run"]] = {**row, "mission": mission["mission"]}
            if not known["live"]:  # the journal is newer than any file
                known |= {one: mission[one] for one in ("outcome", "ended", "began", "outages")}
                known["reason"] = (row if mission["outcome"] else mission)["reason"]
            found.append(known)
        elif not joined[row["run"]]["file"]:  # a live one that is being written
            joined[row["run"]]["file"] = row["file"]
    none = {"stamp": None, "name": None, "live": False, "asks": False, "file": "", "problem": ""}
    return found + [{**none, **one} for one in of_run.values() if one["run"] not in joined]


def _is_mission(row: dict[str, Any], journal: str, name: str) -> bool:
    mission = row["mission"]
    return mission is not None and (mission["journal"], mission["id"]) == (journal, name)


def _is_same(file: dict[str, Any], row: dict[str, Any]) -> bool:
    """Tell whether a file holds the run of a machine's row: it was opened, or is being written."""
    if file["file"] == row["file"]:
        return True
    if file["stamp"] is None or row["stamp"] is None or file["machine"] != row["machine"]:
        return False
    return bool(abs(file["stamp"] - row["stamp"]) < SAME_NS)


def _dated(row: dict[str, Any], shift: int) -> dict[str, Any]:
    """Return a row with its real date, where the mission's own time was virtual.

    `stamp` is when it began by the mission's own time, which names the run.
    """
    times = {name: row[name] for name in ("began", "ended", "last")}
    real = {name: None if at is None else at + shift for name, at in times.items()}
    return {**row, **real, "stamp": row["began"]}


def _read_row(path: Path, size: int) -> dict[str, Any]:
    row: dict[str, Any] = {"id": f"file {path}", "name": None, "live": False, "file": str(path)}
    row |= {"run": "", "mission": None, "asks": False}
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
            row["run"] = recording.run
            listed = run_row(recording.record, recording.events)
            shift = recording.made_ns - recording.stamp_ns
            return {**row, **_dated(listed, shift), "problem": ""}
    nothing |= {"stamp": None, "outcome": None, "reason": "", "strip": [], "outages": []}
    return {**row, **nothing, "problem": problem}
