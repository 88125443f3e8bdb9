"""Durable missions for the home page: what their journals say, and to resume and cancel them."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock
from smachpy.durable.overview import overview
from smachpy.durable.store import (
    CANCELLED,
    ENDED,
    INTERRUPTED,
    OVER,
    QUEUED,
    MissionOverError,
    Store,
    open_store,
)
from smachpy.exceptions import MissionError, SmachError
from smachpy.outcome_classes import outcome_class
from viz.runs.listing import MOST_PIECES, MOST_ROWS, spans_after

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.durable.store import MissionRow

PATIENCE_S: Final = 2.0
"""How long a database that does not answer is waited for; then the page says so."""

AGAIN_S: Final = 10.0
"""How long after that it is asked again."""

MOST_MISSIONS: Final = 300
"""So many of the newest missions of a journal are listed."""

COMMANDS: Final = ("resume", "cancel")


@dataclass(slots=True)
class _Journal:
    """One store, while it can be reached."""

    where: str
    optional: bool  # a file that may not be there
    store: Store | None = None
    problem: str = ""
    asked: float = float("-inf")


class Journals:
    """Lists missions of stores, and resumes and cancels them.

    Args:
        places: Files, and URLs of PostgreSQL.
        default: A file that is listed when it is there.
        logs: The folder to which missions that are resumed here write what they say.

    Threads: every method may be called from any thread; one at a time, and all block for the
        stores, `PATIENCE_S` at most for each that does not answer.
    """

    def __init__(
        self, places: Iterable[str], default: Path | None = None, logs: Path | None = None
    ) -> None:
        names = list(dict.fromkeys(places))
        self._journals = {place: _Journal(place, optional=False) for place in names}
        if default is not None and str(default) not in self._journals:
            self._journals[str(default)] = _Journal(str(default), optional=True)
        self._logs = logs
        self._clock = RealClock()
        self._lock = threading.RLock()
        self._known: dict[tuple[str, str], tuple[Any, dict[str, Any]]] = {}
        self._said: dict[tuple[str, str], str] = {}  # why missions could not be resumed

    def places(self) -> list[dict[str, str]]:
        """Return `name` of each store that was found, without a password, and its `problem`."""
        return [
            {"name": _name(one.where), "problem": one.problem}
            for one in self._journals.values()
            if not one.optional or one.store is not None or one.problem
        ]

    def rows(self) -> list[dict[str, Any]]:
        """Return all missions that are no schedules, as rows of the list of runs (`run_row`).

        Each has `run` beside that, which names it as its recordings do, and `mission`: `id`,
        `journal`, `status`, `active`, `problem`, and `can`, what it may be told here.
        """
        with self._lock:
            return [row for one in self._journals.values() for row in self._rows_of(one)]

    def command(self, journal: str, mission: str, command: str, record: str = "") -> str:
        """Resume or cancel a mission; return what happens now, in words.

        Args:
            journal: As `mission["journal"]` has it.
            mission: Its id.
            command: One of `COMMANDS`. To resume starts a process that outlives this one, in this
                computer, as `smachpy missions resume` does.
            record: The file to which its run goes on to be written; "" for none.

        Raises:
            SmachError: no such journal, mission or command, or it is over.
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
            row = store.mission(mission)
            self._said.pop((found.where, mission), None)
            self._known.pop((found.where, mission), None)
            if command == "cancel":
                store.request_cancel(mission)
                running = row.status not in {INTERRUPTED, *OVER} and row.status != QUEUED
                return "it is preempted" if running else "it is preempted when it goes on"
            if row.status in OVER:
                raise MissionOverError(journal, mission, row.status)
            if "resume" not in _can(overview(store, row)):
                raise MissionError(f"{mission}: status: got {row.status!r}; expected interrupted.")
            self._resume(found.where, mission, record)
            return "it is resumed"

    def close(self) -> None:
        """Close the stores; a second call does nothing."""
        with self._lock:
            for one in self._journals.values():
                self._give_up(one, "")

    # -- the stores ------------------------------------------------------------------------------

    def _open(self, one: _Journal) -> Store | None:
        if one.store is not None:
            return one.store
        if one.optional and not Path(one.where).exists():
            return None
        if one.problem and self._clock.now() < one.asked + AGAIN_S:
            return None
        one.asked = self._clock.now()
        try:
            one.store = open_store(one.where, create=False, patience=PATIENCE_S)
            one.problem = ""
        except (SmachError, ModuleNotFoundError) as error:
            one.problem = str(error)
        return one.store

    def _give_up(self, one: _Journal, problem: str) -> None:
        store, one.store, one.problem = one.store, None, problem
        if store is not None:
            with contextlib.suppress(SmachError):
                store.close()

    def _rows_of(self, one: _Journal) -> list[dict[str, Any]]:
        store = self._open(one)
        if store is None:
            return []
        try:
            found = [row for row in store.missions() if row.every is None][-MOST_MISSIONS:]
            return [self._row(one.where, store, row) for row in found]
        except SmachError as error:
            one.asked = self._clock.now()
            self._give_up(one, str(error))
            return []

    def _row(self, where: str, store: Store, row: MissionRow) -> dict[str, Any]:
        key = where, row.id
        stamp = row.changed, row.status, row.owner, row.cancel
        known = self._known.get(key)
        if known is None or known[0] != stamp or row.status not in OVER:
            known = self._known[key] = stamp, mission_row(overview(store, row), _name(where))
        listed = known[1]
        said = self._said.get(key)
        return listed if said is None else {**listed, "reason": f"not resumed: {said}"}

    # -- processes -------------------------------------------------------------------------------

    def _resume(self, where: str, mission: str, record: str) -> None:
        """Start the process; what it says at its end is told when it failed."""
        words = ["missions", "resume", mission, "--durable", where, "--plain"]
        words += ["--record", record] if record else []
        log = subprocess.DEVNULL if self._logs is None else self._log_file(mission)
        process = subprocess.Popen(  # noqa: S603  our own command
            [sys.executable, "-m", "smachpy.command", *words],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C for the viewer is none for the mission
        )
        if not isinstance(log, int):
            log.close()
        self._clock.spawn(lambda: self._follow(process, where, mission), name=f"resume {mission}")

    def _log_file(self, mission: str) -> Any:
        assert self._logs is not None
        word = "".join(c if c.isalnum() or c in "_.-" else "_" for c in mission)[:80]
        try:
            self._logs.mkdir(parents=True, exist_ok=True)
            return (self._logs / f"{word}.log").open("ab")
        except OSError:
            return subprocess.DEVNULL

    def _follow(self, process: subprocess.Popen[bytes], where: str, mission: str) -> None:
        """Read what a mission says until it ends."""
        assert process.stderr is not None
        last = ""
        with process.stderr:
            for line in process.stderr:
                last = line.decode("utf-8", "replace").strip() or last
        if process.wait() == EXIT_BAD_INPUT:
            with self._lock:
                self._said[where, mission] = last.removeprefix("smachpy: ")


EXIT_BAD_INPUT: Final = 2


def mission_row(facts: dict[str, Any], journal: str) -> dict[str, Any]:
    """Return a mission as a row of the list of runs; pure.

    Args:
        facts: `smachpy.durable.overview.overview`.
        journal: What to call its store.
    """
    began, last, status = facts["began_ns"], facts["last_ns"], facts["status"]
    ended = round(facts["changed"] * 1e9) if status in OVER else None
    outcome = facts["outcome"] or ("cancelled" if status == CANCELLED else None)
    stands = ", ".join(_inside(path) for path in facts["active"])
    reason = "" if status == ENDED else stands
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
    """What a mission may be told."""
    if facts["status"] in OVER or facts["problem"]:
        return []
    return ["cancel"] if facts["status"] != INTERRUPTED else ["resume", "cancel"]


def _strip(facts: dict[str, Any], began: int) -> list[tuple[int, str, float, float | None, str]]:
    """The ends of the root's children, and what is active of them, as `run_row` has it."""
    places = {path: min(i, MOST_ROWS - 1) for i, path in enumerate(facts["rows"] or ())}
    pieces: list[tuple[int, str, float, float | None, str]] = []
    for path, begin, end, outcome in facts["ends"]:
        [(first, last)] = spans_after(began, [(begin, end)])
        kind = str(outcome_class(outcome))
        pieces.append((places.get(path, 0), _label(path), first, last, kind))
    for path, begin in facts["current"]:
        [(first, _)] = spans_after(began, [(begin, begin)])
        pieces.append((places.get(path, 0), _label(path), first, None, "active"))
    return pieces[-MOST_PIECES:]


def _label(path: str) -> str:
    return path.rpartition("/")[2]


def _inside(path: str) -> str:
    """The way to a state below the root."""
    return path.strip("/").partition("/")[2].replace("/", " \u203a ") or path


def _name(where: str) -> str:
    """What to call a store, without the password of its URL."""
    scheme, mark, rest = where.partition("://")
    return f"{scheme}{mark}{rest.rpartition('@')[2]}" if mark else where
