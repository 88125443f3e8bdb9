"""Lists the runs for the home page: those of known machines, in folders and in journals."""

from __future__ import annotations

import itertools
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from smachpy.events.recording import RecordingError, has_end, read_recording, read_summary
from smachpy.exceptions import MissionError
from smachpy_viz.runs.html import MOST_EVENTS
from smachpy_viz.runs.listing import run_row, summary_row

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording, Summary
    from smachpy_viz.live.journals import Journals
    from smachpy_viz.live.machines import Machines

MAX_FILES: Final = 500
"""Recordings in the folders that are listed: the newest ones."""

MAX_OPEN_RECORDINGS: Final = 20
"""Recordings opened from the list that stay in memory."""

DAY_NS: Final = 86_400_000_000_000
"""A machine's clock that differs by more than a day is taken for virtual time."""

MAX_FLEET_RUNS: Final = 32
"""Live runs that are shown together."""

MAX_POSES: Final = 200
"""Newest poses of each of them."""

MAX_GOALS: Final = 100
"""Newest events about goals of each of them."""

SAME_NS: Final = 5_000_000
"""Runs of one machine that began within this time are one run, live and in a file."""

AGAIN: Final = ", again "
"""In the names of machines that show a reproduced run, before its number: they are in no list of
runs, and no name on a network has it."""

MAX_GOOD: Final = 25
"""Good runs with which one that failed is compared."""

LARGEST_GOOD: Final = 20_000_000
"""Largest recording among them [bytes]."""

LARGEST: Final = 200_000_000
"""Largest recording that is shown as a whole: a browser gets it as one text [bytes]."""

LONG: Final = 20_000_000
"""A recording of more bytes that is being written is read again for its row after a rest."""

REST: Final = 20.0
"""The rest, as a multiple of the time that reading took."""


class Runs:
    """Lists runs and opens recordings.

    Args:
        machines: The known machines; an opened recording becomes one of them.
        folders: Folders of recordings; they need not exist.
        journals: Journals of durable missions; None for none.

    Attributes:
        machines: The known machines.

    Threads: every method may be called from any thread; all read files.
    """

    def __init__(
        self,
        machines: Machines,
        folders: Iterable[Path] = (),
        journals: Journals | None = None,
    ) -> None:
        self.machines = machines
        self._journals = journals
        self._folders = list(dict.fromkeys(folders))
        self._lock = threading.Lock()
        # Rows of files, with the time and size by which a change is noticed, and the end of the
        # rest.
        self._rows: dict[Path, tuple[tuple[int, int], dict[str, Any], float]] = {}
        self._opening = threading.Lock()
        # Names of machines with the same of their files, in the order of their opening.
        self._opened: dict[str, tuple[int, int]] = {}

    def rows(self) -> dict[str, Any]:
        """Return `runs`, newest first, `folders`, and `journals` (`Journals.places`).

        A row has the keys of `run_row` and: `id`; `name` of the machine, None for a file that is
        not open; `live`; `file`, "" for none; `problem`, why a file cannot be read; `run`, the id
        of a durable mission's run, otherwise ""; `stamp`, the beginning by the mission's own time,
        which may be virtual; `asks`, whether a question is open; `mission`, None or as in
        `Journals.rows`. A run on the network, in files and in a journal is one row.
        """
        missions = [] if self._journals is None else self._journals.rows()
        with self._lock:
            rows = [
                self._row_of(name)
                for name in (one["name"] for one in self.machines.summaries())
                if name not in self._opened and AGAIN not in name
            ]
            files = self._files()
            # Reading a recording takes long: rows of unchanged files are kept, others dropped.
            self._rows = {path: self._rows[path] for path in files if path in self._rows}
            recorded = [self._row_of_file(path) for path in files]
            # A live run is usually recorded as well: the live row stays.
            known = {file["id"] for row in rows for file in self._files_of(row, recorded)}
            rows += [row for row in recorded if row["id"] not in known]
            rows = with_missions(rows, missions)
        rows.sort(key=lambda row: (row["live"], row["began"] or 0), reverse=True)
        return {
            "runs": rows,
            "folders": [str(folder) for folder in self._folders],
            "journals": [] if self._journals is None else self._journals.places(),
        }

    def fleet(self, skip: int = 0) -> dict[str, Any]:
        """Return `MAX_FLEET_RUNS` of the live runs as rows with the data for a common map.

        Args:
            skip: So many runs are left out before those, by name.

        Returns:
            `rows`; `skip`, and `total`, the number of live runs. A row has the newest map and the
            newest poses of the robot in `observed`, and the newest events about goals in `events`.
            Recordings and machines whose program is gone are left out.
        """
        names = [
            one["name"]
            for one in self.machines.summaries()
            if one["stale"] is None and not one["recorded"] and one["ended"] is None
        ]
        skip = max(0, min(skip, len(names) - 1))
        found = []
        for name in names[skip : skip + MAX_FLEET_RUNS]:
            machine = self.machines.get(name)
            if machine is None or not (row := self._row_of(name))["live"]:
                continue
            maps = machine.newest_observed("map", 1)
            poses = machine.newest_observed("pose", MAX_POSES)
            goals = machine.newest_events("Goal", MAX_GOALS)
            found.append({**row, "observed": maps + poses, "events": goals})
        return {"rows": found, "skip": skip, "total": len(names)}

    def command(self, mission: dict[str, Any]) -> str:
        """Resume or cancel a durable mission; return a text that says what happens now.

        Args:
            mission: The texts `journal`, `id` and `command`.

        Raises:
            SmachError: a text is missing, or as for `Journals.command`.
        """
        words = [mission.get(name) for name in ("journal", "id", "command")]
        if self._journals is None or not all(isinstance(word, str) for word in words):
            raise MissionError(
                f"mission: got {sorted(mission)}; expected the texts journal, id and command of a "
                "mission that is listed."
            )
        journal, name, command = map(str, words)
        # A resumed run continues its recording, so that it stays one run in one file.
        listed = self.rows()["runs"]
        file = next((one["file"] for one in listed if _is_mission(one, journal, name)), "")
        return self._journals.command(journal, name, command, file)

    def open(self, run: str) -> str:
        """Return the name of the machine that shows a run; read its file if necessary.

        Args:
            run: The `id` of a row.

        Raises:
            RecordingError: there is no such run, or its file cannot be read.
        """
        kind, _, name = run.partition(" ")
        if kind == "machine" and self.machines.get(name) is not None:
            return name
        path = Path(name)
        with self._opening:  # the list of runs does not wait for it
            files = self._files()
            # Only files that are listed: a page must not read any other file of this computer.
            if kind != "file" or path not in files:
                raise RecordingError(name, "no such run; expected one in the list.")
            shown = f"run {path.name}"
            other = self.machines.get(shown)
            twice = sum(one.name == path.name for one in files) > 1
            if twice or (other is not None and other.file != str(path)):
                shown = f"run {path}"
            stamp = _stamp_of(path)
            if self.machines.get(shown) is None or self._opened.get(shown) != stamp:
                recording = read_for_page(path)
                self._opened.setdefault(shown, stamp)  # before it is known: it is no live machine
                self.machines.load(shown, recording)
            with self._lock:
                self._opened.pop(shown, None)  # moved to the end: the most recently used
                self._opened[shown] = stamp
                while len(self._opened) > MAX_OPEN_RECORDINGS:
                    oldest = next(iter(self._opened))
                    del self._opened[oldest]
                    self.machines.forget(oldest)
        return shown

    def file_of(self, name: str) -> Path | None:
        """Return the recording of a machine's newest run; None without one.

        Args:
            name: A machine's name.
        """
        machine = self.machines.get(name)
        if machine is None or machine.record is None or AGAIN in name:
            return None
        if machine.file:
            return Path(machine.file).absolute()
        row = self._row_of(name)
        with self._lock:
            recorded = [self._row_of_file(path) for path in self._files()]
            return next((Path(one["file"]) for one in self._files_of(row, recorded)), None)

    def good(self, name: str) -> Iterator[tuple[StateRecord, Sequence[dict[str, Any]]]]:
        """Yield the newest good runs of a machine in files: structure and events, 25 at most."""
        machine = self.machines.get(name)
        if machine is None or machine.record is None:
            return
        record = machine.record
        with self._lock:
            rows = [self._row_of_file(path) for path in self._files()]
        good = (
            Path(row["file"])
            for row in rows
            if row["machine"] == record.label
            and row["outcome"] is not None
            and record.class_of(row["outcome"]) == "success"
        )
        for path in itertools.islice(good, MAX_GOOD):
            try:
                if path.stat().st_size <= LARGEST_GOOD:
                    recording = read_recording(path)
                    yield recording.record, recording.events
            except (OSError, RecordingError):
                continue  # it was removed, or has changed, since it was listed

    def _files(self) -> list[Path]:
        found: list[tuple[int, Path]] = []
        for folder in self._folders:
            for path in folder.glob("*.jsonl") if folder.is_dir() else ():
                try:
                    found.append((path.stat().st_mtime_ns, path))
                except OSError:  # removed since `glob` listed it
                    continue
        return [path for _, path in sorted(found, reverse=True)[:MAX_FILES]]

    def _row_of(self, name: str) -> dict[str, Any]:
        machine = self.machines.get(name)
        assert machine is not None
        assert machine.record is not None
        row = machine.row()
        live = not machine.recorded and machine.stale is None
        behind = machine.behind or 0
        # A recording says when it was made; of a live machine only the difference of clocks shows
        # that its time is virtual.
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

    def _files_of(
        self, row: dict[str, Any], recorded: Iterable[dict[str, Any]]
    ) -> list[dict[str, Any]]:
        """Return the rows of the files that have a machine's run.

        Args:
            row: The machine's.
            recorded: Those of all files, the newest first.
        """
        found = [one for one in recorded if _is_same(one, row)]
        if not any(map(_is_virtual, found)):
            return found
        # All runs in virtual time begin at the same instant.
        if row["file"]:
            own = Path(row["file"]).absolute()
            return [one for one in found if Path(one["file"]).absolute() == own]
        newer = self._newer_runs(row)
        return found[newer : newer + 1]

    def _newer_runs(self, row: dict[str, Any]) -> int:
        """Return how many newer programs of a machine had a run that began at the same instant."""
        machine = self.machines.get(row["name"])
        later = None if machine is None else self.machines.get(machine.after or row["name"])
        count = 0
        while later is not None and later is not machine:
            began = self._row_of(later.name)["stamp"]
            count += began is not None and abs(began - row["stamp"]) < SAME_NS
            later = self.machines.get(later.before or "")
        return count

    def _row_of_file(self, path: Path) -> dict[str, Any]:
        stamp = _stamp_of(path)
        known, now = self._rows.get(path), RealClock.now()
        if known is not None and (
            stamp == known[0] or (stamp[1] > LONG and now < known[2] and not has_end(path))
        ):
            return known[1]
        row = _read_row(path, stamp[1])
        self._rows[path] = stamp, row, now + REST * (RealClock.now() - now)
        return row


def _stamp_of(path: Path) -> tuple[int, int]:
    """Return time of change and size of a file, by which a change is noticed."""
    try:
        facts = path.stat()
    except OSError:
        return 0, 0
    return facts.st_mtime_ns, facts.st_size


def read_for_page(path: Path) -> Recording:
    """Return a recording for a page, to be read event by event; the newest ones of a huge one.

    Raises:
        RecordingError: it cannot be read.
    """
    is_whole = _stamp_of(path)[1] <= LARGEST
    return read_recording(path, stream=is_whole, newest=None if is_whole else MOST_EVENTS)


def with_missions(
    rows: list[dict[str, Any]], missions: Iterable[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Join rows of runs with their missions; missions without a run get a row of their own."""
    of_run = {one["run"]: one for one in missions}
    joined: dict[str, dict[str, Any]] = {}  # by run; a live row comes before its recording's
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
        elif not joined[row["run"]]["file"]:  # the recording of a live run is dropped but for this
            joined[row["run"]]["file"] = row["file"]
    empty = {"stamp": None, "name": None, "live": False, "asks": False, "file": "", "problem": ""}
    return found + [{**empty, **one} for one in of_run.values() if one["run"] not in joined]


def _is_mission(row: dict[str, Any], journal: str, name: str) -> bool:
    mission = row["mission"]
    return mission is not None and (mission["journal"], mission["id"]) == (journal, name)


def _is_same(file: dict[str, Any], row: dict[str, Any]) -> bool:
    """Return whether a file has a machine's run: it was opened from it, or is being written."""
    if file["file"] == row["file"]:
        return True
    if file["stamp"] is None or row["stamp"] is None or file["machine"] != row["machine"]:
        return False
    return bool(abs(file["stamp"] - row["stamp"]) < SAME_NS)


def _is_virtual(file: dict[str, Any]) -> bool:
    """Return whether the time of a file's run was virtual."""
    return file["stamp"] is not None and abs(file["began"] - file["stamp"]) > DAY_NS


def _dated(row: dict[str, Any], shift: int) -> dict[str, Any]:
    """Shift a row's times to the real date, in case the mission's own time was virtual.

    `stamp` keeps the beginning by the mission's own time, by which a run is recognised.
    """
    times = {name: row[name] for name in ("began", "ended", "last")}
    real = {name: None if at is None else at + shift for name, at in times.items()}
    return {**row, **real, "stamp": row["began"]}


def _read_row(path: Path, size: int) -> dict[str, Any]:
    read: Summary | Recording
    row: dict[str, Any] = {"id": f"file {path}", "name": None, "live": False, "file": str(path)}
    row |= {"run": "", "mission": None, "asks": False}
    try:
        if size > LARGEST:
            summary = read_summary(path)
            read, listed = summary, summary_row(summary)
        else:
            recording = read_recording(path, stream=True)
            read, listed = recording, run_row(recording.record, recording.events)
    except RecordingError as error:
        row |= dict.fromkeys(("began", "ended", "last", "stamp", "outcome"))
        row |= {"machine": path.stem, "robots": [], "reason": "", "strip": [], "outages": []}
        return {**row, "problem": str(error)}
    dated = _dated(listed, read.made_ns - read.stamp_ns)
    return {**row, **dated, "run": read.run, "problem": ""}
