"""The machines that the page can show, with their events: from the network or from files."""

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
from viz.model.labels import innermost
from viz.model.progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from smachpy.events.recording import Recording

KEPT_EVENTS = 20_000
"""Events of a live machine that are kept; older ones remain only in counts and newest values."""

KEPT_BYTES = 64_000_000
"""Limit for the text of the kept events [characters]."""

KEPT_OBSERVED = 40_000
"""Records of robot topics that are kept of a live machine, besides the newest maps."""

KEPT_RUNS = 3
"""Earlier programs of a machine that can still be shown after it was started again."""


class Machine:
    """One machine: its structure, the kept events, and the state of the run before them.

    Two states are folded from events: `_base` from those that are no longer kept, and `_now` from
    all of them. `_folded` is the number of the last event in `_base`, `_seq` of that in `_now`.

    Args:
        name: The name under which it is listed.
        on_change: Called after every change, with the machine.
        keep: Called with a copy of this machine when another program takes over its name; stores
            the copy and returns its new name.
        floor: The map if the robot publishes none, a record of `smachpy.network.observations`.

    Attributes:
        record: Its structure; None until it is known.
        revision: Number of structures so far.
        problems: Findings of the checks, from the machine's program.
        stale: When its program disappeared [ns since the epoch]; None while it is there.
        control: Pause and breakpoints; None if it takes no commands.
        recorded: Whether all events come from a file or an earlier program.
        node: Name of its node.
        file: Its recording; "" for none.
        behind: How far its clock is behind this process's [ns]; None while unknown.
        epoch: Identifies the program, as the numbers of events begin anew with each one.
        before: Name of the machine that shows the previous program.
        after: Of a previous program: name of the machine that took its place.
        run: Id of the run of a durable mission; "" for others.
        date_shift: Real time minus the recording's own time, which may be virtual [ns].

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
        # Of a resumed mission: base and events from its earlier processes.
        self._earlier: tuple[dict[str, Any], list[dict[str, Any]]] | None = None
        self._shift = (
            0  # added to the numbers of this process's events: the earlier ones come first
        )
        self._on_change = on_change
        self._lock = threading.Lock()
        self._base = RunState()
        self._now = RunState()
        # Number, record and JSON text; the text is made once for all pages.
        self._events: deque[tuple[int, dict[str, Any], str]] = deque()
        self._bytes = 0
        self._seq = 0
        self._folded = 0
        self._observed: deque[tuple[int, dict[str, Any], str]] = deque()
        # The newest map of each robot: it is published once and must outlive the bounded records.
        self._maps: dict[str, tuple[int, dict[str, Any], str]] = {}
        self._observed_seq = 0

    @property
    def observed_seq(self) -> int:
        """Number of the newest record of robot topics."""
        return self._observed_seq

    @property
    def seq(self) -> int:
        """Number of the newest event."""
        return self._seq

    def load(self, recording: Recording) -> None:
        """Show a recording, with all of its events."""
        self.recorded, self.file = True, str(recording.path)
        self.date_shift = recording.made_ns - recording.stamp_ns
        self.reset(recording.history(), limit=len(recording.events) + 1)

    def reset(self, history: dict[str, Any], *, limit: int = KEPT_EVENTS) -> None:
        """Replace everything by a history from a server (`smachpy.network.feed`) or a file."""
        record = StateRecord.from_json(json.dumps(history["description"]))
        # Another epoch is another program. If it continues the same durable run and knows only its
        # own part, the earlier part is put before it; otherwise the earlier program is kept as a
        # machine of its own.
        if str(history["epoch"]) != self.epoch:
            same_run = bool(self.run) and history.get("run") == self.run
            self._earlier = self.history() if same_run and _begins_in_the_middle(history) else None
            if not same_run and self._now.data["started"] is not None:
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
            # Two deep copies: folding an event changes the data in place.
            self._base = RunState(json.loads(json.dumps(base)) if base else None)
            self._now = RunState(json.loads(json.dumps(base)) if base else None)
            self._events.clear()
            self._bytes = self._seq = self._folded = 0
            if events:  # events that the machine dropped before the first one are not missing
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
        """Move the contents to a new machine and return it; this one is about to be reset."""
        kept = Machine(self.name, self._on_change, floor=self._floor)
        with self._lock:
            kept.record, kept.revision, kept.problems = self.record, self.revision, self.problems
            # The epoch must differ, or a page would take its last event's number for one of this.
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
        """Set the structure."""
        with self._lock:
            changed = record != self.record
            self._set_record(record)
        if changed:
            self._on_change(self)

    def add(self, records: Iterable[dict[str, Any]]) -> bool:
        """Add events, each with its `seq`; return False if some before them are missing.

        Known events are skipped. Events dropped by the machine itself (`smachpy.events.buffer`) do
        not count as missing.
        """
        with self._lock:
            for record in map(self._shifted, records):
                if record["seq"] <= self._seq:  # came with the history as well
                    continue
                if record["seq"] - record.get("dropped", 0) > self._seq + 1:
                    return False
                self._append(record, KEPT_EVENTS)
        self._on_change(self)
        return True

    def observe(self, records: Iterable[dict[str, Any]]) -> None:
        """Add records of robot topics, each with its number `n`; known ones are skipped."""
        with self._lock:
            self._observe(records)
        self._on_change(self)

    def _observe(self, records: Iterable[dict[str, Any]]) -> None:
        for record in records:
            if record["n"] <= self._observed_seq:
                continue
            self._observed_seq = record["n"]
            entry = record["n"], record, record_text(record)
            # Data of other shapes is passed on: who uses it leaves it out.
            if record.get("what") == "map" and isinstance(record.get("robot"), str):
                self._maps[record["robot"]] = entry
            self._observed.append(entry)
            while len(self._observed) > KEPT_OBSERVED and not self.recorded:
                self._observed.popleft()

    def observed(self) -> list[dict[str, Any]]:
        """Return the kept records of robot topics, oldest first."""
        with self._lock:
            return [record for _, record, _ in self._all_observed()]

    def observed_since(self, seq: int) -> list[str]:
        """Return the kept records of robot topics after number `seq`, as JSON texts."""
        # From the end: a page usually lacks only the newest records of thousands.
        with self._lock:
            if seq <= 0:
                return [text for _, _, text in self._all_observed()]
            newer = itertools.takewhile(lambda one: one[0] > seq, reversed(self._observed))
            texts = [text for _, _, text in newer]
        texts.reverse()
        return texts

    def _all_observed(self) -> list[tuple[int, dict[str, Any], str]]:
        # Newest maps that are no longer among the kept records come before them.
        first = self._observed[0][0] if self._observed else 0
        maps = [one for one in self._maps.values() if one[0] < first]
        if self._floor is not None and not self._maps:
            maps = [(0, self._floor, record_text(self._floor))]
        return [*maps, *self._observed]

    def set_stale(self, since: int | None) -> None:
        """Set when the machine's program disappeared; None if it is there."""
        self.stale = since
        self._on_change(self)

    def set_control(self, state: dict[str, Any]) -> None:
        """Set pause and breakpoints, from the machine's state message."""
        self.control = {"paused": state["paused"], "breakpoints": state["breakpoints"]}
        self._on_change(self)

    def since(self, seq: int) -> list[str] | None:
        """Return the events after number `seq` as JSON texts; None if some are no longer kept."""
        with self._lock:
            if not self._folded <= seq <= self._seq:
                return None
            newer = itertools.takewhile(lambda one: one[0] > seq, reversed(self._events))
            texts = [text for _, _, text in newer]
        texts.reverse()
        return texts

    def snapshot(self, *, short: bool = False) -> tuple[int, str]:
        """Return the newest event's number and everything a new page needs, as JSON.

        Args:
            short: Leave out the events, for pages that are too far behind.
        """
        with self._lock:
            base = json.dumps((self._now if short else self._base).data)
            texts = [] if short else [text for _, _, text in self._events]
            seq = self._seq
            head = json.dumps({**self._facts(), "seq": seq, "problems": self.problems})
        # The events are JSON already; they are joined outside the lock, which `add` needs.
        return seq, f'{head[:-1]}, "base": {base}, "events": [{", ".join(texts)}]}}'

    def events(self) -> list[dict[str, Any]]:
        """Return the kept events."""
        with self._lock:
            return [record for _, record, _ in self._events]

    def history(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Return a copy of the state before the kept events, and these events, consistently."""
        with self._lock:
            copy: dict[str, Any] = json.loads(json.dumps(self._base.data))
            return copy, [record for _, record, _ in self._events]

    def active(self) -> list[str]:
        """Return the paths of the running states."""
        with self._lock:
            return self._now.active()

    def questions(self) -> dict[str, dict[str, Any]]:
        """Return path -> question for unanswered questions, the oldest first."""
        with self._lock:
            return self._now.questions()

    def facts(self) -> dict[str, Any]:
        """Return the facts about the machine besides its events."""
        with self._lock:
            return self._facts()

    def summary(self) -> dict[str, Any]:
        """Return the facts for a list of machines."""
        with self._lock:
            run = self._now.data
            return {
                **self._facts(),
                "active": innermost(self._now.active())[:8],
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
        # The oldest events move from the queue into the base, so base and queue make up the run.
        while len(self._events) > limit or (self._bytes > KEPT_BYTES and not self.recorded):
            self._folded, old, text = self._events.popleft()
            self._bytes -= len(text)
            self._base.fold(old)


def _begins_in_the_middle(history: dict[str, Any]) -> bool:
    """Return whether a server knows only its own part of a run that another process began."""
    base, events = history.get("base"), history["events"]
    is_first = not base or base["started"] is None
    return is_first and bool(events) and bool(events[0]["kind"] == "Recovered")


def with_progress(record: dict[str, Any], goals: dict[str, Any]) -> dict[str, Any]:
    """Return `record`; if it is feedback, with `progress`: fraction, distance [m] and text.

    Args:
        record: The record of an event.
        goals: The goals of `RunState` before that event.
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
    """All known machines, by name.

    Args:
        floor: As for `Machine`.

    Threads: every method may be called from any thread; listeners are called from any.
    """

    def __init__(self, floor: dict[str, Any] | None = None) -> None:
        self._floor = floor
        self._lock = threading.Lock()
        self._machines: dict[str, Machine] = {}
        self._listeners: list[Callable[[Machine], object]] = []

    def get(self, name: str) -> Machine | None:
        """Return the machine of that name, or None."""
        return self._machines.get(name)

    def first(self) -> Machine | None:
        """Return the first machine by name; one whose program is there comes before others."""
        known = self.summaries()
        candidates = [one for one in known if one["stale"] is None] or known
        return self.get(candidates[0]["name"]) if candidates else None

    def obtain(self, name: str) -> Machine:
        """Return the machine of that name; create it if necessary."""
        with self._lock:
            if name not in self._machines:
                self._machines[name] = Machine(name, self._changed, self._keep, self._floor)
            return self._machines[name]

    def _keep(self, machine: Machine) -> str:
        """Keep the machine of a previous program under its name and start time."""
        began = datetime.fromtimestamp(machine.summary()["started"] / 1e9).astimezone()
        with self._lock:
            earlier = [name for name, one in self._machines.items() if one.after == machine.name]
            for name in earlier[: max(0, len(earlier) - KEPT_RUNS + 1)]:
                del self._machines[name]
            first = f"{machine.name}, run of {began:%H:%M:%S}"
            # Programs can be started twice in a second.
            names = (f"{first} ({n})" if n > 1 else first for n in itertools.count(1))
            machine.name = next(name for name in names if name not in self._machines)
            self._machines[machine.name] = machine
        return machine.name

    def forget(self, name: str) -> None:
        """Remove a machine."""
        with self._lock:
            self._machines.pop(name, None)

    def summaries(self) -> list[dict[str, Any]]:
        """Return the summaries of all machines, sorted by name."""
        with self._lock:
            machines = sorted(self._machines.items())
        return [machine.summary() for _, machine in machines if machine.record is not None]

    def listen(self, listener: Callable[[Machine], object]) -> None:
        """Call `listener` after every change of a machine."""
        self._listeners.append(listener)

    def _changed(self, machine: Machine) -> None:
        for listener in list(self._listeners):  # a copy: others may be added meanwhile
            listener(machine)
