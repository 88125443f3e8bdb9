"""Mission coverage: the states, outcomes, edges, preempt points and timeouts that tests ran."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

from smachpy.events import Entered, Finished, Left, Preempted, PreemptRequested
from smachpy.events.introspection import StateRecord
from smachpy.testing.runs import own_timeouts

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from smachpy.events import Event
    from smachpy.testing.runs import Run

KINDS = ("states", "outcomes", "edges", "preempts", "timeouts")


@dataclass(slots=True)
class Measured:
    """The coverage of one machine.

    Attributes:
        record: The machine.
        runs: Number of runs.
        taken: Kind ("states", ...) -> item -> how often.
    """

    record: StateRecord
    runs: int = 0
    taken: dict[str, dict[str, int]] = field(default_factory=lambda: {kind: {} for kind in KINDS})

    @property
    def name(self) -> str:
        """The machine's path."""
        return self.record.path

    def items(self, kind: str) -> list[str]:
        """Return everything of a kind that could be run."""
        return _items(self.record, kind)

    def missed(self, kind: str) -> list[str]:
        """Return the items of a kind that were not run."""
        return [item for item in self.items(kind) if item not in self.taken[kind]]

    def counts(self, kind: str) -> tuple[int, int]:
        """Return how many items of a kind were run, and how many there are."""
        items = self.items(kind)
        return sum(item in self.taken[kind] for item in items), len(items)

    @property
    def percent(self) -> float:
        """Share of all items that were run [%]."""
        pairs = [self.counts(kind) for kind in KINDS]
        total = sum(total for _, total in pairs)
        return 100.0 * sum(run for run, _ in pairs) / total if total else 100.0

    def count(self, kind: str, item: str, number: int = 1) -> None:
        """Note that an item was run."""
        taken = self.taken[kind]
        taken[item] = taken.get(item, 0) + number


class Coverage:
    """The coverage of all machines of a test session."""

    def __init__(self) -> None:
        self._machines: dict[str, Measured] = {}

    @property
    def machines(self) -> list[Measured]:
        """The machines, by name."""
        return sorted(self._machines.values(), key=lambda machine: machine.name)

    def add(self, run: Run) -> None:
        """Add a run."""
        record = (
            run.whole or run.record
        )  # as without doubles: they do not make another machine of it
        measured = self._of(record)
        measured.runs += 1
        active: dict[str, None] = {}
        leaves = {state.path for state in record.walk() if not state.is_container}
        for path in run.timeouts():
            measured.count("timeouts", path)
        for item in _followed(record, run.events):
            measured.count("edges", item)
        for event in run.events:
            if isinstance(event, Entered):
                active[event.path] = None
                measured.count("states", event.path)
            elif isinstance(event, Left):
                active.pop(event.path, None)
                measured.count("outcomes", f"{event.path} -{event.outcome}->")
                measured.count("edges", f"{event.path} -{event.outcome}->")
            elif isinstance(event, Finished):
                measured.count("states", event.path)
                measured.count("outcomes", f"{event.path} -{event.outcome}->")
            elif isinstance(event, PreemptRequested):
                # The request counts as well as the outcome: a leaf may end otherwise at that
                # moment.
                if event.path in leaves and event.path in active:
                    measured.count("preempts", event.path)
            elif isinstance(event, Preempted) and event.label:
                measured.count("preempts", f"{event.path}/{event.label}")

    def merge(self, other: Coverage) -> None:
        """Add the coverage of another process."""
        for found in other.machines:
            measured = self._of(found.record)
            measured.runs += found.runs
            for kind, items in found.taken.items():
                for item, number in items.items():
                    measured.count(kind, item, number)

    def _of(self, record: StateRecord) -> Measured:
        key = _key(record)
        if key not in self._machines:
            self._machines[key] = Measured(record)
        return self._machines[key]

    # -- reports -------------------------------------------------------------------------------

    def table(self) -> str:
        """Return the figures as a table for a terminal."""
        if not self._machines:
            return "no mission ran"
        rows: list[tuple[str, ...]] = [("machine", "runs", *KINDS, "all")]
        for machine in self.machines:
            counts = ["{}/{}".format(*machine.counts(kind)) for kind in KINDS]
            rows.append((machine.name, str(machine.runs), *counts, f"{machine.percent:.0f} %"))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = []
        for name, *cells in rows:
            padded = map(str.rjust, cells, widths[1:])
            lines.append("  ".join([name.ljust(widths[0]), *padded]))
        missed = [
            f"{machine.name}: {kind} not run: {_list(machine.missed(kind))}"
            for machine in self.machines
            for kind in KINDS
            if machine.missed(kind)
        ]
        return "\n".join([*lines, *missed])

    def summary(self) -> dict[str, Any]:
        """Return the figures as plain data, for JSON."""
        return {
            "machines": [
                {
                    "name": machine.name,
                    "runs": machine.runs,
                    "percent": round(machine.percent, 2),
                    **{
                        kind: {
                            **dict(zip(("run", "total"), machine.counts(kind), strict=True)),
                            "missed": machine.missed(kind),
                            "times": machine.taken[kind],
                        }
                        for kind in KINDS
                    },
                }
                for machine in self.machines
            ]
        }

    def to_json(self) -> str:
        """Return everything, for `from_json` in another process."""
        return json.dumps([[asdict(m.record), m.runs, m.taken] for m in self.machines])

    @classmethod
    def from_json(cls, text: str) -> Coverage:
        """Rebuild what `to_json` returned."""
        coverage = cls()
        for record, runs, taken in json.loads(text):
            made = StateRecord.from_json(json.dumps(record))
            coverage._machines[_key(made)] = Measured(made, runs, taken)
        return coverage


def _key(record: StateRecord) -> str:
    """Return a key for a machine: its name and structure, independent of the doubles in it."""
    return hashlib.sha256(_bare(record).to_json().encode()).hexdigest()


def _bare(record: StateRecord) -> StateRecord:
    children = tuple(_bare(child) for child in record.children)
    return replace(record, type_name="", doc="", details=(), children=children)


def _ends(record: StateRecord) -> dict[str, list[str]]:
    """Return the ends of children from which transitions lead on, and where to, each once."""
    found: dict[str, list[str]] = {}
    for state in record.walk():
        for edge in state.transitions:
            targets = found.setdefault(f"{state.path}/{edge.source} -{edge.outcome}->", [])
            if edge.target not in targets:
                targets.append(edge.target)
    return found


def _forks(record: StateRecord) -> dict[str, list[str]]:
    """Return the ends after which conditions decide where to go on."""
    return {end: targets for end, targets in _ends(record).items() if len(targets) > 1}


def _followed(record: StateRecord, events: Iterable[Event]) -> Iterator[str]:
    """Yield the edges that a run takes where conditions decide."""
    forks = _forks(record)
    cleanups = {f"{state.path}/{state.cleanup}" for state in record.walk() if state.cleanup}
    at: dict[str, str] = {}  # path of a container -> the end of a child, until it is followed
    for event in events if forks else ():
        above, _, label = event.path.rpartition("/")
        if isinstance(event, Entered) and event.path not in cleanups:
            container, target = above, label
        elif isinstance(event, Left | Finished):
            container, target = event.path, str(event.outcome)
        else:
            continue
        end = at.pop(container, "")
        if target in forks.get(end, ()):
            yield f"{end} {target}"
        if isinstance(event, Left) and (end := f"{event.path} -{event.outcome}->") in forks:
            at[above] = end


def _list(items: Iterable[str]) -> str:
    shown = list(items)
    most = 8
    more = f", and {len(shown) - most} more" if len(shown) > most else ""
    return ", ".join(shown[:most]) + more


def _items(record: StateRecord, kind: str) -> list[str]:
    """Return everything of a kind that could be run."""
    states = list(record.walk())
    own = own_timeouts(record)
    if kind == "states":
        return [state.path for state in states]
    if kind == "outcomes":
        return [f"{state.path} -{outcome}->" for state in states for outcome in state.outcomes]
    if kind == "edges":
        forks = _forks(record)
        return [
            item
            for end in _ends(record)
            for item in ([f"{end} {target}" for target in forks[end]] if end in forks else [end])
        ]
    if kind == "preempts":  # a leaf without the outcome 'preempted' takes no time
        return [s.path for s in states if not s.is_container and "preempted" in s.outcomes]
    return [s.path for s in states if "timeout" in dict(s.details) or s.path in own]
