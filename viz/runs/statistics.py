"""What recorded runs add up to, and how two sets of them differ."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy.run_state import RAISED
from viz.model import outcome_class
from viz.runs.recording import find_recordings, read_recording

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from smachpy.introspection import StateRecord
    from viz.runs.recording import Recording


@dataclass(slots=True)
class StateStatistics:
    """One state over all runs.

    Attributes:
        durations: Of finished visits [s].
        outcomes: Times each outcome ended it.
        visits: Times it was entered.
    """

    visits: int = 0
    durations: list[float] = field(default_factory=list)
    outcomes: dict[str, int] = field(default_factory=dict)

    def failures(self) -> float:
        """Return the share of visits that failed or raised, 0 to 1."""
        ended = sum(self.outcomes.values())
        bad = sum(n for out, n in self.outcomes.items() if outcome_class(out) == "failure")
        return bad / ended if ended else 0.0

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "visits": self.visits,
            "outcomes": self.outcomes,
            "median": quantile(self.durations, 0.5),
            "p95": quantile(self.durations, 0.95),
            "total": sum(self.durations),
            "failures": self.failures(),
        }


@dataclass(slots=True)
class Statistics:
    """All states over all runs of one machine.

    Attributes:
        runs: Number of runs.
        outcomes: How they ended.
        durations: How long they took [s].
        states: By path.
    """

    runs: int = 0
    outcomes: dict[str, int] = field(default_factory=dict)
    durations: list[float] = field(default_factory=list)
    states: dict[str, StateStatistics] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "runs": self.runs,
            "outcomes": self.outcomes,
            "median": quantile(self.durations, 0.5),
            "p95": quantile(self.durations, 0.95),
            "states": {path: state.to_json() for path, state in self.states.items()},
        }

    def add(self, events: Iterable[dict[str, Any]]) -> None:
        """Count the events of one file."""
        since: dict[str, int] = {}
        for event in events:
            kind, path, stamp = event["kind"], event["path"], event["stamp_ns"]
            if kind in {"Started", "Entered"}:
                since[path] = stamp
                self._state(path).visits += 1
                self.runs += kind == "Started"
            elif kind in {"Left", "Failed", "Finished"}:
                outcome = event.get("outcome") or RAISED
                state = self._state(path)
                state.outcomes[outcome] = state.outcomes.get(outcome, 0) + 1
                if path in since:
                    state.durations.append((stamp - since.pop(path)) / 1e9)
                if kind == "Finished":
                    self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1
                    self.durations += state.durations[-1:]

    def _state(self, path: str) -> StateStatistics:
        if path not in self.states:
            self.states[path] = StateStatistics()
        return self.states[path]


@dataclass(frozen=True, slots=True)
class Difference:
    """How two machines, or two sets of runs, differ.

    Attributes:
        added: Paths that only the second machine has.
        removed: Paths that only the first has.
        moved: Pairs (old path, new path) of states of one label and kind.
        rewired: Pairs (path, outcome) whose target is another.
        changed: By path: what the numbers were and are, where they differ notably.
    """

    added: tuple[str, ...]
    removed: tuple[str, ...]
    moved: tuple[tuple[str, str], ...]
    rewired: tuple[tuple[str, str], ...]
    changed: dict[str, tuple[dict[str, Any], dict[str, Any]]]

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "added": list(self.added),
            "removed": list(self.removed),
            "moved": [list(pair) for pair in self.moved],
            "rewired": [list(pair) for pair in self.rewired],
            "changed": {path: list(pair) for path, pair in self.changed.items()},
        }


def quantile(values: Sequence[float], share: float) -> float | None:
    """Return the smallest value that `share` of the values do not exceed; None of none."""
    if not values:
        return None
    ordered = sorted(values)
    return ordered[min(int(share * len(ordered)), len(ordered) - 1)]


def count(recordings: Iterable[Recording]) -> Statistics:
    """Return what the recordings add up to."""
    statistics = Statistics()
    for recording in recordings:
        statistics.add(recording.events)
    return statistics


def never_taken(record: StateRecord, statistics: Statistics) -> list[tuple[str, str]]:
    """Return the written transitions that no run has taken, as pairs (path, outcome)."""
    return [
        (f"{container.path}/{edge.source}", edge.outcome)
        for container in record.walk()
        for edge in container.transitions
        if not edge.implicit and not _taken(statistics, f"{container.path}/{edge.source}", edge)
    ]


def _taken(statistics: Statistics, path: str, edge: Any) -> bool:
    state = statistics.states.get(path)
    return state is not None and edge.outcome in state.outcomes


SLOWER = 1.2
"""Medians that differ by less than this factor are no change."""

LEAST_S = 0.005


def compare(first: Sequence[Recording], second: Sequence[Recording]) -> Difference:
    """Return how the second runs, and their machine, differ from the first."""
    old, new = first[-1].record, second[-1].record
    old_states = {state.path.removeprefix(old.path): state for state in old.walk()}
    new_states = {state.path.removeprefix(new.path): state for state in new.walk()}
    added = [path for path in new_states if path not in old_states]
    removed = [path for path in old_states if path not in new_states]
    moved = []
    for path in list(removed):
        state = old_states[path]
        for other in added:
            twin = new_states[other]
            if (twin.label, twin.kind, twin.type_name) == (
                state.label, state.kind, state.type_name,
            ):  # fmt: skip
                moved.append((path, other))
                added.remove(other)
                removed.remove(path)
                break
    changed = _changed(count(first), old.path, count(second), new.path)
    rewired = _rewired(old, new)
    return Difference(tuple(added), tuple(removed), tuple(moved), rewired, changed)


def _rewired(old: StateRecord, new: StateRecord) -> tuple[tuple[str, str], ...]:
    before, after = _targets(old), _targets(new)
    return tuple(key for key, target in after.items() if before.get(key, target) != target)


def _targets(record: StateRecord) -> dict[tuple[str, str], str]:
    return {
        (f"{state.path.removeprefix(record.path)}/{edge.source}", edge.outcome): edge.target
        for state in record.walk()
        for edge in state.transitions
    }


def _changed(
    first: Statistics, first_root: str, second: Statistics, second_root: str
) -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    after = {path.removeprefix(second_root): state for path, state in second.states.items()}
    found = {}
    for path, state in first.states.items():
        twin = after.get(path.removeprefix(first_root))
        if twin is None:
            continue
        old, new = state.to_json(), twin.to_json()
        if _differs(old, new):
            found[path.removeprefix(first_root)] = old, new
    return found


def _differs(old: dict[str, Any], new: dict[str, Any]) -> bool:
    if old["failures"] != new["failures"] or set(old["outcomes"]) != set(new["outcomes"]):
        return True
    low, high = sorted((old["median"] or 0.0, new["median"] or 0.0))
    return bool(high - low > LEAST_S and high > SLOWER * low)


class StatisticsOfFiles:
    """Counts recorded runs by machine, when they are asked for.

    Args:
        places: Files and folders.
    """

    def __init__(self, places: Iterable[str | Path]) -> None:
        self._places = list(places)
        self._found: dict[str, dict[str, Any]] | None = None

    def of(self, label: str) -> dict[str, Any] | None:
        """Return the statistics of the machine of that name; None when there are no runs of it.

        Raises:
            RecordingError: a file cannot be read.
        """
        if self._found is None:
            groups: dict[str, list[Recording]] = {}
            for path in find_recordings(self._places):
                recording = read_recording(path)
                groups.setdefault(recording.record.label, []).append(recording)
            self._found = {name: count(runs).to_json() for name, runs in groups.items()}
        return self._found.get(label)
