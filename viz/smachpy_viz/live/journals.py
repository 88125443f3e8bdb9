"""Lists the durable missions of journals for the home page, and resumes and cancels them."""

from __future__ import annotations

import contextlib
import os
import subprocess
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from actionlib_core.process.private_files import make_private_folder, open_private
from actionlib_core.shutdown.child_process import python_command
from smachpy.command import EXIT_ERROR
from smachpy.command.queued import Allowed
from smachpy.command.targets import TargetError
from smachpy.durable.opening import open_store
from smachpy.durable.overview import overview
from smachpy.durable.store import (
    CANCELLED,
    ENDED,
    INTERRUPTED,
    OVER,
    QUEUED,
    MissionOverError,
    Store,
    for_child,
)
from smachpy.durable.store import store_name as _name
from smachpy.events.outcome_classes import outcome_class
from smachpy.exceptions import MissionError, SmachError
from smachpy_viz.runs.listing import MAX_PIECES, MAX_ROWS, spans_after

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.durable.store import MissionRow

PATIENCE_S: Final = 2.0
"""Longest wait for an answer of a database; then the page shows the problem [s]."""

RETRY_S: Final = 10.0
"""Time until a database that did not answer is asked again [s]."""

MAX_MISSIONS: Final = 300
"""Listed missions of a journal: the newest ones."""

COMMANDS: Final = ("resume", "cancel")


@dataclass(slots=True)
class _OpenStore:
    """One store; `store` is None while it cannot be reached."""

    where: str
    optional: bool  # the default file, which need not exist
    store: Store | None = None
    problem: str = ""
    asked: float = float("-inf")  # time of the last failure [s]


class Journals:
    """Lists missions of stores, and resumes and cancels them.

    Args:
        places: Files and PostgreSQL URLs.
        default: A file that is listed if it exists.
        logs: Folder for the output of missions that are resumed from here.
        allow: Places whose missions may be resumed besides the installed ones, see
            `smachpy.command.queued`.

    Threads: every method may be called from any thread. They run one at a time and block for the
        stores, at most `PATIENCE_S` for each one that does not answer.
    """

    def __init__(
        self,
        places: Iterable[str],
        default: Path | None = None,
        logs: Path | None = None,
        allow: Iterable[str] = (),
    ) -> None:
        names = list(dict.fromkeys(places))
        self._journals = {place: _OpenStore(place, optional=False) for place in names}
        if default is not None and str(default) not in self._journals:
            self._journals[str(default)] = _OpenStore(str(default), optional=True)
        self._logs = logs
        self._allow = list(allow)
        self._clock = RealClock()
        self._lock = threading.RLock()
        # By store and mission: its row, and the columns by which a change is noticed.
        self._known: dict[tuple[str, str], tuple[Any, dict[str, Any]]] = {}
        self._failures: dict[tuple[str, str], str] = {}  # why missions could not be resumed

    def places(self) -> list[dict[str, str]]:
        """Return the `name`, without a password, and the `problem` of each store."""
        return [
            {"name": _name(one.where), "problem": one.problem}
            for one in self._journals.values()
            if not one.optional or one.store is not None or one.problem
        ]

    def rows(self) -> list[dict[str, Any]]:
        """Return all missions except schedules, as rows of the list of runs (`run_row`).

        Each row also has `run`, the id that its recordings have too, and `mission`: `id`,
        `journal`, `status`, `active`, `problem` and `can`, the commands that it accepts now.
        """
        with self._lock:
            return [row for one in self._journals.values() for row in self._rows_of(one)]

    def command(self, journal: str, mission: str, command: str, record: str = "") -> str:
        """Resume or cancel a mission; return a text that says what happens now.

        Args:
            journal: The name of the journal, `mission["journal"]` of a row.
            mission: The mission's id.
            command: One of `COMMANDS`. "resume" starts a process on this computer, as
                `smachpy missions resume` does; it outlives the viewer.
            record: The recording that is continued; "" for none.

        Raises:
            SmachError: there is no such journal, mission or command, or the mission is over.
        """
        if command not in COMMANDS:
            raise MissionError(f"command: got {command!r}; expected one of {list(COMMANDS)}.")
        with self._lock:
            found = {_name(one.where): one for one in self._journals.values()}.get(journal)
            if found is None:
                raise MissionError(f"journal: got {journal!r}; expected one that is listed.")
            store = self._open(found)
            if store is None:
                raise MissionError(found.problem or f"{journal}: there is no such journal.")
            row = store.mission(mission)  # raises for an unknown mission
            self._failures.pop((found.where, mission), None)
            self._known.pop((found.where, mission), None)
            if command == "cancel":
                store.request_cancel(mission)
                if row.status == QUEUED:
                    return "it is cancelled"
                later = row.status == INTERRUPTED
                return "it is preempted when it is resumed" if later else "it is preempted"
            if row.status in OVER:
                raise MissionOverError(journal, mission, row.status)
            if "resume" not in _can(overview(store, row)):
                raise MissionError(f"{mission}: status: got {row.status!r}; expected interrupted.")
            problem = Allowed(self._allow).problem(row.target)
            if problem:
                raise TargetError(row.target, problem)
            self._resume(found.where, mission, record)
            return "it is resumed"

    def close(self) -> None:
        """Close the stores; a second call does nothing."""
        with self._lock:
            for one in self._journals.values():
                self._disconnect(one, "")

    # -- the stores ------------------------------------------------------------------------------

    def _open(self, one: _OpenStore) -> Store | None:
        if one.store is not None:
            return one.store
        if one.optional and not Path(one.where).exists():
            return None
        # Each attempt blocks for PATIENCE_S: the page, which asks every few seconds, must not wait
        # for a dead database each time.
        if one.problem and self._clock.now() < one.asked + RETRY_S:
            return None
        one.asked = self._clock.now()
        try:
            one.store = open_store(one.where, create=False, patience=PATIENCE_S)
            one.problem = ""
        except (SmachError, ModuleNotFoundError) as error:
            one.problem = str(error)
        return one.store

    def _disconnect(self, one: _OpenStore, problem: str) -> None:
        store, one.store, one.problem = one.store, None, problem
        if store is not None:
            with contextlib.suppress(SmachError):
                store.close()

    def _rows_of(self, one: _OpenStore) -> list[dict[str, Any]]:
        store = self._open(one)
        if store is None:
            return []
        try:
            rows = store.missions(limit=MAX_MISSIONS)
            found = [self._row(one.where, store, row) for row in rows if row.every is None]
        except SmachError as error:
            one.asked = self._clock.now()
            self._disconnect(one, str(error))
            return []
        ids = {row.id for row in rows}  # others were pruned, or are older
        self._known = {
            key: known for key, known in self._known.items() if key[0] != one.where or key[1] in ids
        }
        return found

    def _row(self, where: str, store: Store, row: MissionRow) -> dict[str, Any]:
        key = where, row.id
        # The row of a mission that is over stays the same: its journal is not read again.
        stamp = row.changed, row.status, row.owner, row.cancel
        known = self._known.get(key)
        if known is None or known[0] != stamp or row.status not in OVER:
            known = self._known[key] = stamp, mission_row(overview(store, row), _name(where))
        listed = known[1]
        if row.status != INTERRUPTED:  # it goes on since, or another process has it
            self._failures.pop(key, None)
        failure = self._failures.get(key)
        return listed if failure is None else {**listed, "reason": f"not resumed: {failure}"}

    # -- processes -------------------------------------------------------------------------------

    def _resume(self, where: str, mission: str, record: str) -> None:
        """Start the process; a thread waits for its end and keeps its error message."""
        address, secrets = for_child(where)
        # With "=", an id that begins with a dash cannot be taken for an option.
        words = ["missions", "resume", f"--durable={address}", "--plain"]
        words += ["--record", record] if record else []
        words += [*(f"--allow={place}" for place in self._allow), "--", mission]
        log = subprocess.DEVNULL if self._logs is None else self._log_file(mission)
        process = subprocess.Popen(  # noqa: S603  our own command
            python_command("-m", "smachpy.command", *words),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.PIPE,
            env={**os.environ, **secrets},
            start_new_session=True,  # the terminal's Ctrl-C for the viewer must not reach it
        )
        if not isinstance(log, int):
            log.close()
        self._clock.spawn(lambda: self._follow(process, where, mission), name=f"resume {mission}")

    def _log_file(self, mission: str) -> Any:
        assert self._logs is not None
        # An id is chosen by a user or program and must not lead out of the folder.
        word = "".join(c if c.isalnum() or c in "_.-" else "_" for c in mission)[:80]
        try:
            make_private_folder(self._logs)
            return open_private(self._logs / f"{word}.log", "ab")
        except OSError:  # without its log a mission can still be resumed
            return subprocess.DEVNULL

    def _follow(self, process: subprocess.Popen[bytes], where: str, mission: str) -> None:
        """Read a mission's error output until it ends; a full pipe would block the mission."""
        assert process.stderr is not None
        last = ""
        with process.stderr:
            for line in process.stderr:
                last = line.decode("utf-8", "replace").strip() or last
        # Other exit codes are the outcome of a mission that was resumed.
        if process.wait() == EXIT_ERROR:
            with self._lock:
                self._failures[where, mission] = last.removeprefix("smachpy: ")


def mission_row(facts: dict[str, Any], journal: str) -> dict[str, Any]:
    """Return a mission as a row of the list of runs. A pure function.

    Args:
        facts: The mission's `smachpy.durable.overview.overview`.
        journal: Name of its store.
    """
    # The store has seconds as float; events, and so the rows, have nanoseconds.
    began, last, status = facts["began_ns"], facts["last_ns"], facts["status"]
    ended = round(facts["changed"] * 1e9) if status in OVER else None
    outcome = facts["outcome"] or ("cancelled" if status == CANCELLED else None)
    reason = "" if status == ENDED else ", ".join(_inside(path) for path in facts["active"])
    if facts["problem"]:
        reason = f"its journal cannot be read: {facts['problem']}"
    first = began or round(facts["created"] * 1e9)
    return {
        "id": f"mission {journal} {facts['id']}",
        "run": facts["run"],
        "machine": facts["name"],
        "robots": [facts["robot"]] if facts["robot"] else [],
        "began": first,
        "ended": ended,
        "last": ended or last or first,
        "outcome": outcome,
        "reason": reason,
        "strip": [] if began is None else _strip(facts, began),
        "outages": [] if began is None else spans_after(began, facts["outages"]),
        "mission": {
            "id": facts["id"],
            "journal": journal,
            "status": status,
            "active": facts["active"],
            "problem": facts["problem"],
            "can": _can(facts),
        },
    }


def _can(facts: dict[str, Any]) -> list[str]:
    """The commands that a mission accepts now."""
    if facts["status"] in OVER or facts["problem"]:
        return []
    return ["cancel"] if facts["status"] != INTERRUPTED else ["resume", "cancel"]


def _strip(facts: dict[str, Any], began: int) -> list[tuple[int, str, float, float | None, str]]:
    """The ended and running visits of the root's children, in the form of `run_row`."""
    places = {path: min(i, MAX_ROWS - 1) for i, path in enumerate(facts["rows"] or ())}
    pieces: list[tuple[int, str, float, float | None, str]] = []
    for path, begin, end, outcome in facts["ends"]:
        [(first, last)] = spans_after(began, [(begin, end)])
        kind = str(outcome_class(outcome))
        pieces.append((places.get(path, 0), _label(path), first, last, kind))
    for path, begin in facts["current"]:
        [(first, _)] = spans_after(began, [(begin, begin)])
        pieces.append((places.get(path, 0), _label(path), first, None, "active"))
    return pieces[-MAX_PIECES:]


def _label(path: str) -> str:
    return path.rpartition("/")[2]


def _inside(path: str) -> str:
    """The labels from the root down to a state."""
    return path.strip("/").partition("/")[2].replace("/", " \u203a ") or path
