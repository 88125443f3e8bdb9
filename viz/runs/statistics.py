"""What recorded runs add up to, and how two sets of them differ."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy.events.recording import each_recording, find_recordings
from smachpy.events.run_state import RAISED
from viz.model.labels import WATCHING, end_class
from viz.model.machine import Marks

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from smachpy.events.recording import Recording
    from smachpy.introspection import StateRecord


@dataclass(slots=True)
class StateStatistics:
    """One state over all runs.

    Attributes:
        durations: Of finished visits [s].
        outcomes: Times each outcome ended it.
        visits: Times it was entered.
        retries: Times it was tried again.
        kind: "monitor", ...: what a monitor finds, 'invalid' too, is no failure.
    """

    visits: int = 0
    durations: list[float] = field(default_factory=list)
    outcomes: dict[str, int] = field(default_factory=dict)
    retries: int = 0
    kind: str = ""

    def failures(self) -> float:
        """Return the share of visits that failed or raised, 0 to 1."""
        ended = sum(self.outcomes.values())
        bad = sum(n for out, n in self.outcomes.items() if end_class(self.kind, out) == "failure")
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
            "retries": self.retries,
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

    def add(self, events: Iterable[dict[str, Any]], record: StateRecord | None = None) -> None:
        """Count the events of one file; `record` is its machine, which says what only watches."""
        for one in () if record is None else record.walk():
            if one.kind in WATCHING:
                self._state(one.path).kind = one.kind
        since: dict[str, int] = {}
        newest: dict[str, tuple[int, str]] = {}  # end and outcome of each state's newest visit
        for event in events:
            kind, path, stamp = event["kind"], event["path"], event["stamp_ns"]
            if kind in {"Started", "Entered"}:
                since[path] = stamp
                self._state(path).visits += 1
                self.runs += kind == "Started"
            elif kind == "Recovered":
                self._recover(event, since, newest)
            elif kind == "Retried":
                self._state(path).retries += 1
            elif kind in {"Left", "Failed", "Finished"}:
                outcome = event.get("outcome") or RAISED
                state = self._state(path)
                state.outcomes[outcome] = state.outcomes.get(outcome, 0) + 1
                newest[path] = stamp, outcome
                if path in since:
                    state.durations.append((stamp - since.pop(path)) / 1e9)
                if kind == "Finished":
                    self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1
                    self.durations += state.durations[-1:]

    def _recover(
        self, event: dict[str, Any], since: dict[str, int], newest: dict[str, tuple[int, str]]
    ) -> None:
        """Another process goes on with the run, and with what the end of the first one ended."""
        root, active = event["path"], dict(event["active"])
        self.runs += root not in since and root not in newest
        for path in [path for path in since if path not in active]:
            del since[path]
        for path, began in active.items():
            if path in since:
                continue
            since[path] = began
            stamp, outcome = newest.pop(path, (-1, ""))
            state = self._state(path)
            if stamp < began:
                state.visits += 1
                continue
            _take_back(state.outcomes, outcome)
            del state.durations[-1:]
            if path == root:
                _take_back(self.outcomes, outcome)
                del self.durations[-1:]

    def _state(self, path: str) -> StateStatistics:
        if path not in self.states:
            self.states[path] = StateStatistics()
        return self.states[path]


def _take_back(outcomes: dict[str, int], outcome: str) -> None:
    outcomes[outcome] -= 1
    if not outcomes[outcome]:
        del outcomes[outcome]


ROUNDING = 1e-9  # 0.95 * 20 is a little more than 19


def quantile(values: Sequence[float], share: float) -> float | None:
    """Return the smallest value that `share` of the values do not exceed; None of none."""
    if not values:
        return None
    ordered = sorted(values)
    rank = math.ceil(share * len(ordered) - ROUNDING)
    return ordered[max(rank, 1) - 1]


class Counted(NamedTuple):
    """The runs of one machine.

    Attributes:
        record: The machine as it was in its last recording.
        statistics: What all of them add up to.
        dropped: Events that are missing in them.
    """

    record: StateRecord
    statistics: Statistics
    dropped: int


def count_by_machine(recordings: Iterable[Recording]) -> dict[str, Counted]:
    """Count recordings by the machine's label; none is kept longer than until the next comes."""
    found: dict[str, Counted] = {}
    for recording in recordings:
        label = recording.record.label
        before = found.get(label)
        statistics = Statistics() if before is None else before.statistics
        statistics.add(recording.events, recording.record)
        dropped = recording.dropped + (0 if before is None else before.dropped)
        found[label] = Counted(recording.record, statistics, dropped)
    return found


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


def marks_of(statistics: Statistics, record: StateRecord, *, heat: str = "time") -> Marks:
    """Return what recorded runs leave on a picture of their machine.

    Args:
        statistics: Of the runs.
        record: The machine; states of other names are left out.
        heat: What makes a state hot: `time`, its share of all time spent in states that have no
            states inside, against the greatest; or `failures`, the share of its visits that failed.
    """
    there = {state.path: state for state in record.walk()}
    states = {path: s for path, s in statistics.states.items() if path in there}
    totals = {path: sum(s.durations) for path, s in states.items() if not there[path].children}
    most = max(totals.values(), default=0.0)
    if heat == "failures":
        hot = {path: s.failures() for path, s in states.items() if not there[path].children}
    else:
        hot = {path: total / most for path, total in totals.items() if most}
    return Marks(
        visits={path: s.visits for path, s in states.items()},
        taken={(path, o): n for path, s in states.items() for o, n in s.outcomes.items()},
        runs=max(statistics.runs, 1),
        heat=hot,
        notes={path: _note(s) for path, s in states.items()},
    )


def _note(state: StateStatistics) -> str:
    median = quantile(state.durations, 0.5)
    words = [f"\u00d7{state.visits}"]
    words += [f"{median:.3g} s"] if median is not None else []
    words += [f"{state.failures():.0%} failed"] if state.failures() >= LEAST_SHARE else []
    return ", ".join(words)


LEAST_SHARE = 0.005
SLOWER = 1.2
"""Medians that differ by less than this factor are no change."""

LEAST_S = 0.005


def moved_states(old: StateRecord, new: StateRecord) -> list[tuple[str, str]]:
    """Return pairs (old path, new path), from the root, of states that are elsewhere now."""
    before = {state.path.removeprefix(old.path): state for state in old.walk()}
    after = {state.path.removeprefix(new.path): state for state in new.walk()}
    fresh = [path for path in after if path not in before]
    moved = []
    for path, state in before.items():
        if path in after:
            continue
        for other in fresh:
            twin = after[other]
            if (twin.label, twin.kind, twin.type_name) == (
                state.label, state.kind, state.type_name,
            ):  # fmt: skip
                moved.append((path, other))
                fresh.remove(other)
                break
    return moved


def _states_below(record: StateRecord) -> set[tuple[str, str]]:
    """Path from the root and kind of all states."""
    return {(state.path.removeprefix(record.path), state.kind) for state in record.walk()}


class StatisticsOfFiles:
    """Counts recorded runs by machine, when they are asked for.

    Args:
        places: Files and folders.

    Raises:
        RecordingError: there is no such file or folder.

    Threads: every method may be called from any thread.
    """

    def __init__(self, places: Iterable[str | Path]) -> None:
        self._places = list(places)
        find_recordings(self._places)
        self._lock = threading.Lock()
        self._found: dict[str, Counted] | None = None

    def of(self, record: StateRecord) -> dict[str, Any] | None:
        """Return the statistics of a machine; None when there are no runs of it.

        Its runs are those of its name, else those of a machine with the same states, which may
        be shown under another name ("/SM_ROOT"); paths are those of `record`.

        Raises:
            RecordingError: a file cannot be read.
        """
        found = self._read()
        if record.label in found:
            return found[record.label].statistics.to_json()
        states = _states_below(record)
        for recorded, statistics, _ in found.values():
            if _states_below(recorded) == states:
                told = statistics.to_json()
                told["states"] = {
                    record.path + path.removeprefix(recorded.path): numbers
                    for path, numbers in told["states"].items()
                }
                return told
        return None

    def counted(self) -> dict[str, Statistics]:
        """Return the statistics by machine; raises as `of`."""
        return {label: counted.statistics for label, counted in self._read().items()}

    def _read(self) -> dict[str, Counted]:
        with self._lock:
            if self._found is None:
                self._found = count_by_machine(each_recording(self._places))
            return self._found
