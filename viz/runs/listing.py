"""One run as a row of a list: machine, robots, outcome, strip of states, cause of a failure.

Pure functions of the machine's structure and the run's events.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from smachpy.events.run_state import RAISED
from smachpy.outcome_classes import outcome_class
from viz.model.labels import end_class, shorten
from viz.model.why import newest_run, why

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from smachpy.introspection import StateRecord

MOST_ROWS: Final = 8
"""Rows of a concurrence's strip; further branches share the last one."""

MOST_PIECES: Final = 80
MOST_ROBOTS: Final = 4
LONGEST: Final = 160
"""Length of the reason [characters]."""

_ENDS: Final = frozenset({"Left", "Failed", "Finished"})


def run_row(record: StateRecord, events: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the row for the newest run in `events`.

    Returns:
        `machine`; `robots`: the namespaces of its actions; `began`, `ended` and `last`, the newest
        event [ns since the epoch, None if unknown]; `outcome`: None if the run has not ended;
        `reason`: the first cause of a failure, or the running state, or ""; `strip`: for each visit
        the row, the state's name, begin and end [s since the run began; None: still running] and
        the class of its outcome; `outages`: pairs [s since the run began] without a process.
    """
    found = why(record, events)
    kind = None if found.outcome is None else outcome_class(found.outcome)
    steps = found.steps
    reason = ""
    if found.outcome == RAISED or kind in {"failure", "preempted"}:
        reason = _cause(steps[0]) if steps else ""
    elif found.outcome is None and steps:
        reason = _name(steps[0].path, record)
    run = newest_run(events, record.path)
    began = found.began or 0
    # Each Recovered event lists the outages so far.
    last = next((one for one in reversed(run) if one["kind"] == "Recovered"), None)
    return {
        "machine": record.label,
        "robots": _robots(run),
        "began": found.began,
        "ended": found.ended if found.outcome is not None else None,
        "last": found.ended,
        "outcome": found.outcome,
        "reason": shorten(reason, LONGEST),
        "strip": [] if found.began is None else _strip(record, run, found.began),
        "outages": [] if last is None else spans_after(began, last["outages"]),
    }


def spans_after(began: int, spans: Iterable[Sequence[int]]) -> list[tuple[float, float]]:
    """Convert pairs of instants [ns] to seconds after `began`."""
    return [(round((a - began) / 1e9, 3), round((b - began) / 1e9, 3)) for a, b in spans]


def _cause(step: Any) -> str:
    name = step.path.rpartition("/")[2]
    return f"{name}: {step.what}" + (f", {step.reason}" if step.reason else "")


def _name(path: str, record: StateRecord) -> str:
    """The labels from the root down to a state."""
    return path.removeprefix(record.path).strip("/").replace("/", " \u203a ")


def _robots(run: Sequence[dict[str, Any]]) -> list[str]:
    actions = (str(one.get("action") or "") for one in run if one["kind"] == "GoalSent")
    names = {action.lstrip("/").rpartition("/")[0] for action in actions}
    return sorted(name for name in names if name)[:MOST_ROBOTS]


def _strip(
    record: StateRecord, run: Sequence[dict[str, Any]], began: int
) -> list[tuple[int, str, float, float | None, str]]:
    """The visits of the root's children; each branch of a concurrence has its own row."""
    children = {child.path: number for number, child in enumerate(record.children)}
    kinds = {child.path: child.kind for child in record.children}
    rows = record.kind == "concurrence"
    since: dict[str, float] = {}  # start of each running visit, by path
    pieces: list[tuple[int, str, float, float | None, str]] = []

    def add(path: str, to: float | None, kind: str) -> None:
        row = min(children[path], MOST_ROWS - 1) if rows else 0
        pieces.append((row, path.rpartition("/")[2], since.pop(path), to, kind))

    for event in run:
        path, at = event["path"], round((event["stamp_ns"] - began) / 1e9, 3)
        if event["kind"] == "Recovered":
            # The visits that the resumed mission runs; others that were cut off have no end.
            known = [(one, start) for one, start in event["active"] if one in children]
            since = {one: since.get(one, (start - began) / 1e9) for one, start in known}
        if path not in children:
            continue
        if event["kind"] == "Entered":
            since[path] = at
        elif event["kind"] in _ENDS and path in since:
            add(path, at, end_class(kinds[path], event.get("outcome") or RAISED))
    for path in list(since):
        add(path, None, "active")
    pieces.sort(key=lambda piece: piece[2])
    return _fewer(pieces)


def _fewer(
    pieces: list[tuple[int, str, float, float | None, str]],
) -> list[tuple[int, str, float, float | None, str]]:
    """The longest pieces, if there are too many; a running piece counts as endless."""
    if len(pieces) <= MOST_PIECES:
        return pieces
    by_length = sorted(pieces, key=lambda p: float("inf") if p[3] is None else p[3] - p[2])
    kept = by_length[-MOST_PIECES:]
    return sorted(kept, key=lambda piece: piece[2])
