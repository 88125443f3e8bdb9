"""Counts visits, outcomes and durations over recorded runs."""

from __future__ import annotations

import math
import threading
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from smachpy.events.recording import each_recording, find_recordings
from smachpy.events.run_state import RAISED
from smachpy_viz.model.labels import WATCHING, end_class
from smachpy_viz.model.machine import Marks

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording


@dataclass(slots=True)
class StateStatistics:
    """One state over all runs.

    Attributes:
        visits: Number of visits.
        durations: Durations of the ended visits [s].
        outcomes: Number of visits that ended with each outcome.
        retries: Number of repeated attempts.
        kind: Kind of a state that only observes, such as "monitor": its 'invalid' is not a failure.
        success: The outcomes that are good, if the state says them.
    """

    visits: int = 0
    durations: list[float] = field(default_factory=list)
    outcomes: dict[str, int] = field(default_factory=dict)
    retries: int = 0
    kind: str = ""
    success: tuple[str, ...] | None = None

    def failures(self) -> float:
        """Return the share of ended visits that failed or raised, 0 to 1."""
        ended = sum(self.outcomes.values())
        classes = {out: end_class(self.kind, out, self.success) for out in self.outcomes}
        bad = sum(n for out, n in self.outcomes.items() if classes[out] == "failure")
        return bad / ended if ended else 0.0

    def to_json(self) -> dict[str, Any]:
        """Return this as plain data."""
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
        outcomes: Number of runs that ended with each outcome.
        durations: Durations of the ended runs [s].
        states: Statistics of each state, by path.
    """

    runs: int = 0
    outcomes: dict[str, int] = field(default_factory=dict)
    durations: list[float] = field(default_factory=list)
    states: dict[str, StateStatistics] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return this as plain data."""
        return {
            "runs": self.runs,
            "outcomes": self.outcomes,
            "median": quantile(self.durations, 0.5),
            "p95": quantile(self.durations, 0.95),
            "states": {path: state.to_json() for path, state in self.states.items()},
        }

    def add(self, events: Iterable[dict[str, Any]], record: StateRecord | None = None) -> None:
        """Add the events of one file; `record`, its machine, tells which outcomes are good."""
        if record is not None:
            self._note_good_outcomes(record)  # first: `failures` needs them
        since: dict[str, int] = {}  # start of each running visit [ns], by path
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
                if path in since:  # otherwise the visit began before the recording
                    state.durations.append((stamp - since.pop(path)) / 1e9)
                if kind == "Finished":
                    self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1
                    self.durations += state.durations[-1:]  # the run's is its root's

    def _note_good_outcomes(self, record: StateRecord) -> None:
        for one in record.walk():
            if one.kind in WATCHING or one.success is not None:
                state = self._state(one.path)
                state.kind, state.success = one.kind, one.success

    def _recover(
        self, event: dict[str, Any], since: dict[str, int], newest: dict[str, tuple[int, str]]
    ) -> None:
        """Continue the counting after another process has resumed the run.

        The process that went away may have recorded ends of visits that its shutdown caused; they
        are taken back if the resumed mission is still in those visits.
        """
        root, active = event["path"], dict(event["active"])
        # A file that begins with the resumption has no Started event for this run.
        self.runs += root not in since and root not in newest
        for path in [path for path in since if path not in active]:
            del since[path]
        for path, began in active.items():
            if path in since:
                continue
            since[path] = began
            stamp, outcome = newest.pop(path, (-1, ""))
            state = self._state(path)
            if stamp < began:  # the beginning of this visit is not in the file
                state.visits += 1
                continue
            _decrement(state.outcomes, outcome)
            del state.durations[-1:]
            if path == root:
                _decrement(self.outcomes, outcome)
                del self.durations[-1:]

    def _state(self, path: str) -> StateStatistics:
        if path not in self.states:
            self.states[path] = StateStatistics()
        return self.states[path]


def _decrement(outcomes: dict[str, int], outcome: str) -> None:
    outcomes[outcome] -= 1
    if not outcomes[outcome]:
        del outcomes[outcome]


def quantile(values: Sequence[float], share: float) -> float | None:
    """Return the smallest value that `share` of the values do not exceed; None without values."""
    if not values:
        return None
    ordered = sorted(values)
    # Products such as 0.55 * 20 are slightly above the whole number, and ceil would add one.
    rank = math.ceil(share * len(ordered) - 1e-9)
    return ordered[max(rank, 1) - 1]


class Counted(NamedTuple):
    """The runs of one machine.

    Attributes:
        record: The machine as it was in its last recording.
        statistics: The statistics of all runs.
        dropped: Number of events missing in the recordings.
    """

    record: StateRecord
    statistics: Statistics
    dropped: int


def count_by_machine(recordings: Iterable[Recording]) -> dict[str, Counted]:
    """Return the statistics by machine label; recordings are not kept in memory."""
    found: dict[str, Counted] = {}
    for recording in recordings:
        label = recording.record.label
        before = found.get(label)
        statistics = Statistics() if before is None else before.statistics
        lost = Counter(dropped=0 if before is None else before.dropped)
        statistics.add(_noting(recording.events, lost), recording.record)
        found[label] = Counted(recording.record, statistics, lost["dropped"])
    return found


def _noting(events: Iterable[dict[str, Any]], lost: Counter[str]) -> Iterator[dict[str, Any]]:
    """Yield the events, and count those that were dropped: large recordings are read once."""
    for event in events:
        lost["dropped"] += event.get("dropped", 0)
        yield event


def never_taken(record: StateRecord, statistics: Statistics) -> list[tuple[str, str]]:
    """Return the explicit transitions that no run has taken, as pairs (path, outcome)."""
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
    """Return the marks for drawing statistics on a picture of the machine.

    Args:
        statistics: The statistics of the runs.
        record: The machine; states that it does not have are left out.
        heat: How warm leaves are drawn: `time`, by the time spent in them relative to the leaf
            with the most; `failures`, by the share of their visits that failed.
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
    words += [f"{state.failures():.0%} failed"] if state.failures() >= MIN_SHARE else []
    return ", ".join(words)


MIN_SHARE = 0.005
"""Smaller shares of failures would be shown as 0 % and are left out."""
SLOWER = 1.2
"""Medians that differ by less than this factor count as equal."""
MIN_DURATION_S = 0.005
"""Medians that differ by less than this count as equal [s]."""


def moved_states(old: StateRecord, new: StateRecord) -> list[tuple[str, str]]:
    """Return pairs (old path, new path), relative to the root, of states that have moved."""
    before = {state.path.removeprefix(old.path): state for state in old.walk()}
    after = {state.path.removeprefix(new.path): state for state in new.walk()}
    fresh = [path for path in after if path not in before]
    moved = []
    for path, state in before.items():
        if path in after:
            continue
        for other in fresh:
            twin = after[other]
            # The same label, kind and class elsewhere: each new place is used once.
            if (twin.label, twin.kind, twin.type_name) == (
                state.label, state.kind, state.type_name,
            ):  # fmt: skip
                moved.append((path, other))
                fresh.remove(other)
                break
    return moved


def _states_below(record: StateRecord) -> set[tuple[str, str]]:
    """The path relative to the root, and the kind, of each state."""
    return {(state.path.removeprefix(record.path), state.kind) for state in record.walk()}


class StatisticsOfFiles:
    """Statistics of recorded runs by machine; the files are read on first use.

    Args:
        places: Files and folders.

    Raises:
        RecordingError: a file or folder does not exist.

    Threads: every method may be called from any thread.
    """

    def __init__(self, places: Iterable[str | Path]) -> None:
        self._places = list(places)
        find_recordings(self._places)  # a wrong path is reported at once, not on first use
        self._lock = threading.Lock()
        self._found: dict[str, Counted] | None = None

    def of(self, record: StateRecord) -> dict[str, Any] | None:
        """Return the statistics of a machine; None if it has no runs.

        Runs are found by the machine's name, otherwise by the same states: SMACH's introspection
        can show a machine under another name ("/SM_ROOT"). Paths are those of `record`.

        Raises:
            RecordingError: a file cannot be read.
        """
        found = self._read()
        if record.label in found:
            return found[record.label].statistics.to_json()
        states = _states_below(record)
        for recorded, statistics, _ in found.values():
            if _states_below(recorded) == states:
                renamed = statistics.to_json()
                renamed["states"] = {
                    record.path + path.removeprefix(recorded.path): numbers
                    for path, numbers in renamed["states"].items()
                }
                return renamed
        return None

    def counted(self) -> dict[str, Statistics]:
        """Return the statistics by machine label; raises as `of`."""
        return {label: counted.statistics for label, counted in self._read().items()}

    def _read(self) -> dict[str, Counted]:
        with self._lock:  # one thread reads the files, others wait for it
            if self._found is None:
                self._found = count_by_machine(each_recording(self._places, stream=True))
            return self._found
