"""One run as a row of a list: machine, robots, outcome, strip of states, cause of a failure.

Pure functions of the machine's structure and the run's events.
"""

from __future__ import annotations

from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from smachpy.events import resource_text
from smachpy.events.run_state import RAISED, innermost
from smachpy_viz.model.labels import cleanups, end_class, shorten, tidies
from smachpy_viz.model.why import newest_run, why

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Summary

    _Piece: TypeAlias = tuple[int, str, float, float | None, str]

MAX_ROWS: Final = 8
"""Rows of a concurrence's strip; further branches share the last one."""

MAX_PIECES: Final = 80
MANY_PIECES: Final = 4 * MAX_PIECES
"""Pieces that are kept of a run that goes on, until they are reduced to the longest ones."""

MAX_ROBOTS: Final = 4
MAX_CELL_LENGTH: Final = 160
"""Length of the reason [characters]."""

_ENDS: Final = frozenset({"Left", "Failed", "Finished"})


def run_row(record: StateRecord, events: Iterable[dict[str, Any]]) -> dict[str, Any]:
    """Return the row for the newest run in `events`, which are iterated again for some rows.

    See `RowFold.row`.
    """
    fold = RowFold(record)
    for event in events:
        if event["path"] == record.path and event["kind"] == "Started":
            fold = RowFold(record)
        elif event["path"] == record.path and event["kind"] == "Recovered":
            # Ends that states got only because a process ended are left out.
            fold = RowFold(record)
            for one in newest_run(list(events), record.path):
                fold.add(one)
            break
        fold.add(event)
    return fold.row(lambda: first_cause(record, events))


def summary_row(summary: Summary) -> dict[str, Any]:
    """Return the row of a recording that is not read, without robots, reason and strip."""
    began, last = summary.first_ns, summary.last_ns
    return {
        "machine": summary.machine,
        "robots": [],
        "began": began,
        "ended": None if summary.outcome is None else last,
        "last": last,
        "outcome": summary.outcome,
        "reason": "",
        "strip": [],
        "outages": spans_after(began, summary.outages),
    }


def first_cause(record: StateRecord, events: Iterable[dict[str, Any]]) -> str:
    """Return the first cause of the end of the newest run, or ""."""
    steps = why(record, events).steps
    if not steps:
        return ""
    name = steps[0].path.rpartition("/")[2]
    return f"{name}: {steps[0].what}" + (f", {steps[0].reason}" if steps[0].reason else "")


class RowFold:
    """The row of one run, event by event: neither its cost nor its size grows with the run.

    Args:
        record: The machine.
    """

    def __init__(self, record: StateRecord) -> None:
        self._record = record
        self._children = {child.path: number for number, child in enumerate(record.children)}
        self._states = {child.path: child for child in record.children}
        self._began: int | None = None
        self._last: int | None = None
        self._ended: int | None = None
        self._outcome: str | None = None
        self._robots: list[str] = []
        self._outages: list[tuple[float, float]] = []
        self._active: dict[str, str] = {}  # running states in the order of their begin -> note
        self._since: dict[str, float] = {}  # start of each running child of the root
        self._asking: set[str] = set()  # states whose question is open
        self._pieces: list[_Piece] = []

    def add(self, event: dict[str, Any]) -> None:
        """Add the next event of the run."""
        kind, path, stamp_ns = event["kind"], event["path"], event["stamp_ns"]
        if self._began is None:
            self._began = event.get("began_ns", stamp_ns)
        self._last = stamp_ns
        if kind in {"Started", "Entered"}:
            self._active[path] = ""
        elif kind in {"Noted", "ResourceUse"} and path in self._active:
            self._active[path] = _note(event)
        elif kind in {"QuestionAsked", "QuestionAnswered"}:
            change = self._asking.add if kind == "QuestionAsked" else self._asking.discard
            change(path)
        elif kind == "Recovered":
            self._recover(event)
        elif kind in _ENDS:
            self._active.pop(path, None)
            self._asking.discard(path)
            if path == self._record.path and kind == "Finished":
                self._outcome, self._ended = event.get("outcome") or RAISED, stamp_ns
        elif kind == "GoalSent":
            self._add_robot(str(event.get("action") or ""))
        if path in self._children:
            self._add_visit(kind, path, round((stamp_ns - self._began) / 1e9, 3), event)

    def _add_robot(self, action: str) -> None:
        space = action.lstrip("/").rpartition("/")[0]
        if space and space not in self._robots:
            self._robots = sorted([*self._robots, space])[:MAX_ROBOTS]

    def _recover(self, event: dict[str, Any]) -> None:
        began = self._began or 0
        self._active = {path: self._active.get(path, "") for path, _ in event["active"]}
        self._asking &= self._active.keys()
        # The visits that the resumed mission runs; others that were cut off have no end.
        self._since = {
            one: self._since.get(one, (start - began) / 1e9)
            for one, start in event["active"]
            if one in self._children
        }
        self._outages = spans_after(began, event["outages"])  # each event lists those so far

    def _add_visit(self, kind: str, path: str, at: float, event: dict[str, Any]) -> None:
        if kind == "Entered":
            self._since[path] = at
        elif kind in _ENDS and path in self._since:
            one = self._states[path]
            end = end_class(one.kind, event.get("outcome") or RAISED, one.success)
            self._pieces.append(self._piece(path, at, end))
            if len(self._pieces) > MANY_PIECES:
                self._pieces = _fewer(sorted(self._pieces, key=itemgetter(2)))

    def _piece(self, path: str, to: float | None, kind: str) -> _Piece:
        rows = self._record.kind == "concurrence"  # each branch has its own row
        row = min(self._children[path], MAX_ROWS - 1) if rows else 0
        since = self._since[path] if to is None else self._since.pop(path)
        return row, path.rpartition("/")[2], since, to, kind

    def _kind(self, path: str) -> str:
        """Return "waiting" if a running state, or one in it, asks a person, else "active"."""
        asks = any(f"{one}/".startswith(f"{path}/") for one in self._asking)
        return "waiting" if asks else "active"

    def row(self, cause: Callable[[], str]) -> dict[str, Any]:
        """Return the row.

        Args:
            cause: Called for the first cause if the run has failed.

        Returns:
            `machine`; `robots`: the namespaces of its actions; `began`, `ended` and `last`, the
            newest event [ns since the epoch, None if unknown]; `outcome`: None if the run has not
            ended; `reason`: the first cause of a failure, or the running state, or ""; `strip`: for
            each visit of a child of the root the row, the state's name, begin and end [s since the
            run began; None: still running] and the class of its outcome, "active" or "waiting";
            `outages`: pairs [s since the run began] without a process.
        """
        record, outcome = self._record, self._outcome
        reason = ""
        if outcome is None:
            for path in innermost(self._active)[:1]:
                note = self._active[path]
                tidy = ", tidying up" if tidies(path, cleanups(record)) else ""
                reason = _name(path, record) + tidy + (f": {note}" if note else "")
        elif outcome == RAISED or record.class_of(outcome) in {"failure", "preempted"}:
            reason = cause()
        pieces = [*self._pieces, *(self._piece(one, None, self._kind(one)) for one in self._since)]
        return {
            "machine": record.label,
            "robots": self._robots,
            "began": self._began,
            "ended": self._ended,
            "last": self._last if self._ended is None else self._ended,
            "outcome": outcome,
            "reason": shorten(reason, MAX_CELL_LENGTH),
            "strip": _fewer(sorted(pieces, key=itemgetter(2))),
            "outages": self._outages,
        }


def spans_after(began: int, spans: Iterable[Sequence[int]]) -> list[tuple[float, float]]:
    """Convert pairs of instants [ns] to seconds after `began`."""
    return [(round((a - began) / 1e9, 3), round((b - began) / 1e9, 3)) for a, b in spans]


def _note(event: dict[str, Any]) -> str:
    """Return what a state says about itself, or for which resource it waits."""
    if event["kind"] == "Noted":
        return str(event["text"])
    waits = event["status"] == "waits"
    return resource_text("waits", event["resource"], event["holder"]) if waits else ""


def _name(path: str, record: StateRecord) -> str:
    """The labels from the root down to a state."""
    return path.removeprefix(record.path).strip("/").replace("/", " \u203a ")


def _fewer(pieces: list[_Piece]) -> list[_Piece]:
    """The longest pieces, if there are too many; a running piece counts as endless."""
    if len(pieces) <= MAX_PIECES:
        return pieces
    by_length = sorted(pieces, key=lambda p: float("inf") if p[3] is None else p[3] - p[2])
    kept = by_length[-MAX_PIECES:]
    return sorted(kept, key=itemgetter(2))
