"""What the page can show: machines with their histories, wherever they come from."""

from __future__ import annotations

import itertools
import json
import threading
import uuid
from collections import deque
from dataclasses import asdict
from datetime import datetime
from typing import TYPE_CHECKING, Any

from smachpy.events import record_text
from smachpy.events.run_state import RunState
from smachpy.introspection import StateRecord
from viz.model.progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

KEPT_EVENTS = 20_000
"""So many events of one machine can be wound back; older ones only count."""

KEPT_BYTES = 64_000_000
"""So much text of them at most."""

KEPT_OBSERVED = 40_000
"""So many records of the robot's topics are kept of a live machine, besides the newest maps."""

KEPT_RUNS = 3
"""So many earlier programs of one machine can be looked at after it was started again."""


class Machine:
    """One machine: its structure, the newest events, and what happened before them.

    Args:
        name: What it is found under.
        on_change: Called after every change, with the machine.
        keep: Called before it begins anew for another program, with the machine as it was; keeps it
            under the name that is returned.
        floor: The map where the robot tells of none, a record of `smachpy.network.observations`.

    Attributes:
        record: Its structure; None until it is known.
        revision: Counts the structures.
        stale: Since when nobody speaks for it [ns since the epoch]; None while somebody does.
        control: Pause and breakpoints; None when it obeys no commands.
        node: Name of the node that it runs in.
        file: Where its recording was read from; "" for none.
        behind: How far its clock is behind this process's [ns]; None while nobody knows.
        before: Name of the machine that keeps what the program before this one did.
        after: The same the other way round, of one that is kept.
        run: Names the run of a durable mission; "" for others.
        date_shift: How far the real date of a recording is from its own, if time was virtual [ns].

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        name: str,
        on_change: Callable[[Machine], object],
        keep: Callable[[Machine], str | None] = lambda _machine: None,
        floor: dict[str, Any] | None = None,
    ) -> None:
        self.name = name
        self._floor = floor
        self._keep = keep
        self.before: str | None = None
        self.after: str | None = None
        self.record: StateRecord | None = None
        self.revision = 0
        self.problems: list[dict[str, str]] = []
        self.control: dict[str, Any] | None = None
        self.stale: int | None = None
        self.recorded = False
        self.file = ""
        self.node = ""
        self.behind: int | None = None
        self.epoch = uuid.uuid4().hex
        self.run = ""
        self.date_shift = 0
        self._earlier: tuple[dict[str, Any], list[dict[str, Any]]] | None = None
        self._shift = 0  # added to the numbers of events: what other processes did comes first
        self._on_change = on_change
        self._lock = threading.Lock()
        self._base = RunState()
        self._now = RunState()
        self._events: deque[tuple[int, dict[str, Any], str]] = deque()
        self._bytes = 0
        self._seq = 0
        self._folded = 0  # number of the newest event that went before the kept ones
        self._observed: deque[tuple[int, dict[str, Any], str]] = deque()
        self._maps: dict[str, tuple[int, dict[str, Any], str]] = {}  # the newest of each robot
        self._observed_seq = 0

    @property
    def observed_seq(self) -> int:
        """Number of the newest record of the robot's topics."""
        return self._observed_seq

    @property
    def seq(self) -> int:
        """Number of the newest event."""
        return self._seq

    def reset(self, history: dict[str, Any], *, limit: int = KEPT_EVENTS) -> None:
        """Begin anew with what a server tells (`smachpy.network.feed`), or a file."""
        record = StateRecord.from_json(json.dumps(history["description"]))
        if str(history["epoch"]) != self.epoch:
            goes_on = bool(self.run) and history.get("run") == self.run
            self._earlier = self.history() if goes_on and _begins_in_the_middle(history) else None
            if not goes_on and self._now.data["started"] is not None:
                self.before = self._keep(self._split_off()) or self.before
        with self._lock:
            self.run = str(history.get("run") or "")
            self.epoch = str(history["epoch"])
            self.problems = list(history.get("problems") or ())
            self.control = history.get("control")
            self.stale = None
            self._set_record(record)
            base, events = history.get("base"), history["events"]
            self._shift = 0
            if self._earlier is not None:
                base, earlier = self._earlier
                self._shift = earlier[-1]["seq"] if earlier else 0
                events = [*earlier, *(self._shifted(event) for event in events)]
            self._base = RunState(json.loads(json.dumps(base)) if base else None)
            self._now = RunState(json.loads(json.dumps(base)) if base else None)
            self._events.clear()
            self._bytes = self._seq = self._folded = 0
            if events:
                self._folded = events[0]["seq"] - events[0].get("dropped", 0) - 1
            for event in events:
                self._append(event, limit)
            self._observed.clear()
            self._maps.clear()
            self._observed_seq = 0
            self._observe(history.get("observed") or ())
        self._on_change(self)

    def _shifted(self, record: dict[str, Any]) -> dict[str, Any]:
        return {**record, "seq": record["seq"] + self._shift} if self._shift else record

    def _split_off(self) -> Machine:
        """Return another machine that has what this one has; this one is to begin anew."""
        kept = Machine(self.name, self._on_change, floor=self._floor)
        with self._lock:
            kept.record, kept.revision, kept.problems = self.record, self.revision, self.problems
            kept.recorded, kept.node, kept.epoch = True, self.node, f"kept {self.epoch}"
            kept.run = self.run
            kept.before, kept.after = self.before, self.name
            kept._base, kept._now, kept._bytes = self._base, self._now, self._bytes
            kept._seq, kept._folded = self._seq, self._folded
            kept._events, self._events = self._events, deque()
            kept._observed, self._observed = self._observed, deque()
            kept._maps, self._maps = self._maps, {}
            kept._observed_seq = self._observed_seq
        return kept

    def describe(self, record: StateRecord) -> None:
        """Take a new structure."""
        with self._lock:
            changed = record != self.record
            self._set_record(record)
        if changed:
            self._on_change(self)

    def add(self, records: Iterable[dict[str, Any]]) -> bool:
        """Take events in, each with its `seq`; False when some are missing before them.

        Those that the machine itself has dropped (`smachpy.events.buffer`) are not missed.
        """
        with self._lock:
            for record in map(self._shifted, records):
                if record["seq"] <= self._seq:
                    continue
                if record["seq"] - record.get("dropped", 0) > self._seq + 1:
                    return False
                self._append(record, KEPT_EVENTS)
        self._on_change(self)
        return True

    def observe(self, records: Iterable[dict[str, Any]]) -> None:
        """Take in what the robot's topics told, each with its number `n`; known ones are passed."""
        with self._lock:
            self._observe(records)
        self._on_change(self)

    def _observe(self, records: Iterable[dict[str, Any]]) -> None:
        for record in records:
            if record["n"] <= self._observed_seq:
                continue
            self._observed_seq = record["n"]
            entry = record["n"], record, record_text(record)
            if record["what"] == "map":
                self._maps[record["robot"]] = entry
            self._observed.append(entry)
            while len(self._observed) > KEPT_OBSERVED and not self.recorded:
                self._observed.popleft()

    def observed(self) -> list[dict[str, Any]]:
        """Return what is kept of what the robot's topics told, oldest first."""
        with self._lock:
            return [record for _, record, _ in self._all_observed()]

    def observed_since(self, seq: int) -> list[str]:
        """Return what is kept of what was told after number `seq`, as JSON texts."""
        with self._lock:
            if seq <= 0:
                return [text for _, _, text in self._all_observed()]
            newer = itertools.takewhile(lambda one: one[0] > seq, reversed(self._observed))
            texts = [text for _, _, text in newer]
        texts.reverse()
        return texts

    def _all_observed(self) -> list[tuple[int, dict[str, Any], str]]:
        first = self._observed[0][0] if self._observed else 0
        maps = [one for one in self._maps.values() if one[0] < first]
        if self._floor is not None and not self._maps:
            maps = [(0, self._floor, record_text(self._floor))]
        return [*maps, *self._observed]

    def set_stale(self, since: int | None) -> None:
        """Say since when nobody speaks for the machine."""
        self.stale = since
        self._on_change(self)

    def set_control(self, state: dict[str, Any]) -> None:
        """Take what the machine tells of itself."""
        self.control = {"paused": state["paused"], "breakpoints": state["breakpoints"]}
        self._on_change(self)

    def since(self, seq: int) -> list[str] | None:
        """Return the events after number `seq` as JSON texts; None when some of them are gone."""
        with self._lock:
            if not self._folded <= seq <= self._seq:
                return None
            newer = itertools.takewhile(lambda one: one[0] > seq, reversed(self._events))
            texts = [text for _, _, text in newer]
        texts.reverse()
        return texts

    def snapshot(self, *, short: bool = False) -> tuple[int, str]:
        """Return the newest number and all that a page needs to begin, as JSON.

        Args:
            short: What happened before is not told, for pages that could not follow.
        """
        with self._lock:
            base = json.dumps((self._now if short else self._base).data)
            texts = [] if short else [text for _, _, text in self._events]
            seq = self._seq
            head = json.dumps({**self._facts(), "seq": seq, "problems": self.problems})
        return seq, f'{head[:-1]}, "base": {base}, "events": [{", ".join(texts)}]}}'

    def events(self) -> list[dict[str, Any]]:
        """Return the kept events."""
        with self._lock:
            return [record for _, record, _ in self._events]

    def history(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Return a copy of what happened before the kept events, and those, of one instant."""
        with self._lock:
            copy: dict[str, Any] = json.loads(json.dumps(self._base.data))
            return copy, [record for _, record, _ in self._events]

    def active(self) -> list[str]:
        """Return the paths of what runs."""
        with self._lock:
            return self._now.active()

    def questions(self) -> dict[str, dict[str, Any]]:
        """Return path -> question of those that wait for an answer, the oldest first."""
        with self._lock:
            return self._now.questions()

    def facts(self) -> dict[str, Any]:
        """Return what is known of the machine besides its events."""
        with self._lock:
            return self._facts()

    def summary(self) -> dict[str, Any]:
        """Return what a list of machines shows."""
        with self._lock:
            active = self._now.active()
            leaves = [p for p in active if not any(other.startswith(p + "/") for other in active)]
            run = self._now.data
            return {
                **self._facts(),
                "active": leaves[:8],
                "started": run["started"],
                "ended": run["ended"],
                "outcome": run["outcome"],
                "questions": len(self._now.questions()),
            }

    def _facts(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "label": self.record.label if self.record else self.name,
            "epoch": self.epoch,
            "revision": self.revision,
            "stale": self.stale,
            "control": self.control,
            "recorded": self.recorded,
            "node": self.node,
            "behind": self.behind,
            "before": self.before,
            "after": self.after,
        }

    def _set_record(self, record: StateRecord) -> None:
        if record != self.record:
            self.record = record
            self.revision += 1

    def _append(self, record: dict[str, Any], limit: int) -> None:
        record = with_progress(record, self._now.data["goals"])
        self._now.fold(record)
        self._seq = record["seq"]
        text = record_text(record)
        self._events.append((self._seq, record, text))
        self._bytes += len(text)
        while len(self._events) > limit or (self._bytes > KEPT_BYTES and not self.recorded):
            self._folded, old, text = self._events.popleft()
            self._bytes -= len(text)
            self._base.fold(old)


def _begins_in_the_middle(history: dict[str, Any]) -> bool:
    """Tell whether a server knows only what it did itself of a run that another one has begun."""
    base, events = history.get("base"), history["events"]
    is_first = not base or base["started"] is None
    return is_first and bool(events) and bool(events[0]["kind"] == "Recovered")


def with_progress(record: dict[str, Any], goals: dict[str, Any]) -> dict[str, Any]:
    """Return `record`, with `progress` if it is feedback: fraction, distance [m] and text.

    Args:
        record: A record of an event.
        goals: The goals of `RunState`, before that event.
    """
    if record["kind"] != "GoalFeedback" or "progress" in record:
        return record
    goal = goals.get(record["goal_id"])
    if goal is None:
        return record
    first = goal["first_feedback"]
    feedback = record["feedback"]
    progress = progress_of(goal["goal"], feedback, feedback if first is None else first)
    return {**record, "progress": asdict(progress)}


class Machines:
    """All machines that a page can choose from.

    Args:
        floor: See `Machine`.

    Threads: every method may be called from any thread; listeners are called from any.
    """

    def __init__(self, floor: dict[str, Any] | None = None) -> None:
        self._floor = floor
        self._lock = threading.Lock()
        self._machines: dict[str, Machine] = {}
        self._listeners: list[Callable[[Machine], object]] = []

    def get(self, name: str) -> Machine | None:
        """Return the machine of that name."""
        return self._machines.get(name)

    def first(self) -> Machine | None:
        """Return the first by name of those that are there, else of those that have gone."""
        known = self.summaries()
        there = [one for one in known if one["stale"] is None] or known
        return self.get(there[0]["name"]) if there else None

    def obtain(self, name: str) -> Machine:
        """Return the machine of that name, a new one if there is none."""
        with self._lock:
            if name not in self._machines:
                self._machines[name] = Machine(name, self._changed, self._keep, self._floor)
            return self._machines[name]

    def _keep(self, machine: Machine) -> str:
        """Keep a machine that has been started again, by its name and when it began."""
        began = datetime.fromtimestamp(machine.summary()["started"] / 1e9).astimezone()
        with self._lock:
            earlier = [name for name, one in self._machines.items() if one.after == machine.name]
            for name in earlier[: max(0, len(earlier) - KEPT_RUNS + 1)]:
                del self._machines[name]
            first = f"{machine.name}, run of {began:%H:%M:%S}"
            names = (f"{first} ({n})" if n > 1 else first for n in itertools.count(1))
            machine.name = next(name for name in names if name not in self._machines)
            self._machines[machine.name] = machine
        return machine.name

    def forget(self, name: str) -> None:
        """Know nothing of a machine any more."""
        with self._lock:
            self._machines.pop(name, None)

    def summaries(self) -> list[dict[str, Any]]:
        """Return what is known of every machine, by name."""
        with self._lock:
            machines = sorted(self._machines.items())
        return [machine.summary() for _, machine in machines if machine.record is not None]

    def listen(self, listener: Callable[[Machine], object]) -> None:
        """Call `listener` after every change of a machine."""
        self._listeners.append(listener)

    def _changed(self, machine: Machine) -> None:
        for listener in list(self._listeners):
            listener(machine)
