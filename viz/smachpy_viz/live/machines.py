"""The machines that the page can show, with their events: from the network or from files."""

from __future__ import annotations

import itertools
import json
import logging
import threading
import uuid
from dataclasses import asdict
from datetime import datetime
from typing import TYPE_CHECKING, Any

from actionlib_core.inputs.checked_data import checked
from smachpy.events import record_text
from smachpy.events.introspection import StateRecord
from smachpy.events.run_state import RunState, innermost
from smachpy_viz.live.kept import Kept, with_commas
from smachpy_viz.model.labels import shorten
from smachpy_viz.model.progress import progress_of
from smachpy_viz.model.why import newest_run
from smachpy_viz.runs.listing import RowFold, first_cause

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from smachpy.events.recording import Recording
    from smachpy_viz.runs.notes import RunNote

logger = logging.getLogger("smachpy_viz.live")

MAX_KEPT_EVENTS = 20_000
"""Events of a live machine that are kept; older ones remain only in counts and newest values."""

MAX_KEPT_BYTES = 64_000_000
"""Limit for the text of the kept events [characters]."""

MAX_KEPT_OBSERVATIONS = 40_000
"""Records of robot topics that are kept of a live machine, besides the newest maps."""

MAX_STATES = 20_000
"""States of a live machine that events may be about."""

MAX_KEYS = 10_000
"""Userdata keys of a live machine."""

MAX_GOALS = 2_000
"""Goals of a live machine that run at the same time."""

MAX_ROBOTS = 100
"""Robots whose newest map is kept."""

MAX_MACHINES = 2_000
"""Machines that are followed on the network."""

MAX_REFUSAL_LENGTH = 300
"""Length of the text about a wrong message [characters]."""

MAX_TOTAL_BYTES = 500_000_000
"""Limit for the text of the kept events, and of the records of robot topics, of all machines."""

MAX_KEPT_RUNS = 3
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
        budget: Returns the limit for the text of its kept events, and of its records of robot
            topics [characters].

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
        version: Number of its newest change, counted over all machines of a `Machines`.
        refused: Number of messages, or parts of them, that were left out because they were wrong.
        refusal: What was wrong with the newest of these, and who sent it; "" for none.
        notes: Notes on the run that are kept beside no recording.
        noted: Number of changes of its notes, wherever they are kept.

    Threads: every method may be called from any thread.
    """

    def __init__(
        self,
        name: str,
        on_change: Callable[[Machine], object],
        keep: Callable[[Machine], str | None] = lambda _machine: None,
        floor: dict[str, Any] | None = None,
        budget: Callable[[], int] = lambda: MAX_KEPT_BYTES,
    ) -> None:
        self.name = name
        self._floor = floor
        self._keep = keep
        self._budget = budget
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
        self.version = 0
        self.refused = 0
        self.refusal = ""
        self.notes: list[RunNote] = []
        self.noted = 0
        # Of a resumed mission: base and events from its earlier processes.
        self._earlier: tuple[dict[str, Any], list[dict[str, Any]]] | None = None
        self._shift = (
            0  # added to the numbers of this process's events: the earlier ones come first
        )
        self._on_change = on_change
        self._lock = threading.Lock()
        self._base = RunState()
        self._now = RunState()
        self._row: RowFold | None = None  # of the newest run; None until it is made from the events
        self._cause: tuple[int, str] = (-1, "")  # number of the last event then, and the cause
        self._events = Kept()
        self._seq = 0
        self._folded = 0
        self._observed = Kept()
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

    def load(self, recording: Recording, *, packs: bool = False) -> None:
        """Show a recording, with all of its events.

        Args:
            recording: The recording; its events may be read from the file one by one.
            packs: Whether they take a tenth of the memory; then it takes long to find one of them.
        """
        self.recorded, self.file = True, str(recording.path)
        self.date_shift = recording.made_ns - recording.stamp_ns
        self.reset(recording.history(), packs=packs)

    def reset(
        self, history: dict[str, Any], *, limit: int = MAX_KEPT_EVENTS, packs: bool = False
    ) -> None:
        """Replace everything by a history that was checked, from the network or a file.

        Args:
            history: As a server sends it.
            limit: The most events of a live machine that are kept.
            packs: As for `load`.
        """
        described = history["description"]
        if not isinstance(described, StateRecord):
            described = checked(StateRecord, described)
        record: StateRecord = described
        # Another epoch is another program. If it continues the same durable run and knows only its
        # own part, the earlier part is put before it; otherwise the earlier program is kept as a
        # machine of its own.
        if str(history["epoch"]) != self.epoch:
            same_run = bool(self.run) and history.get("run") == self.run
            self._earlier = None
            if same_run and _begins_in_the_middle(history):
                before, kept = self.history()
                self._earlier = before, list(kept)
            if not same_run and self._now.data["started"] is not None:
                self.before = self._keep(self._split_off()) or self.before
            if not same_run:
                self.notes = []
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
            self._events = Kept(packs=packs)
            self._row, self._cause = RowFold(record), (-1, "")
            self._seq = self._folded = 0
            for event in events:
                if not self._seq:  # events that the machine dropped before it are not missing
                    self._folded = event["seq"] - event.get("dropped", 0) - 1
                self._append(event, limit)
            self._observed = Kept(packs=packs)
            self._maps.clear()
            self._observed_seq = 0
            self._observe(history.get("observed") or ())
        self._on_change(self)

    def _shifted(self, record: dict[str, Any]) -> dict[str, Any]:
        return {**record, "seq": record["seq"] + self._shift} if self._shift else record

    def _split_off(self) -> Machine:
        """Move the contents to a new machine and return it; this one is about to be reset."""
        kept = Machine(self.name, self._on_change, floor=self._floor, budget=self._budget)
        with self._lock:
            kept.record, kept.revision, kept.problems = self.record, self.revision, self.problems
            # The epoch must differ, or a page would take its last event's number for one of this.
            kept.recorded, kept.node, kept.epoch = True, self.node, f"kept {self.epoch}"
            kept.run, kept.notes = self.run, self.notes
            kept.before, kept.after = self.before, self.name
            kept._base, kept._now = self._base, self._now
            kept._seq, kept._folded = self._seq, self._folded
            kept._events, self._events = self._events, Kept()
            self._row = None
            kept._observed, self._observed = self._observed, Kept()
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
                self._append(record)
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
            robot = record["robot"]
            if record["what"] == "map" and (robot in self._maps or len(self._maps) < MAX_ROBOTS):
                self._maps[robot] = entry
            self._observed.append(*entry)
            while not self.recorded and (
                len(self._observed) > MAX_KEPT_OBSERVATIONS or self._observed.size > self._budget()
            ):
                self._observed.popleft()

    def observed(self) -> list[dict[str, Any]]:
        """Return the kept records of robot topics, oldest first."""
        with self._lock:
            return [*(record for _, record, _ in self._old_maps()), *self._observed.records()]

    def observed_since(self, seq: int) -> Iterable[str]:
        """Return the kept records of robot topics after number `seq`, as texts of JSON.

        Each has one or several records, with commas between these.
        """
        with self._lock:
            newer = self._observed.after(seq) if seq > 0 else None
            if newer is not None:
                return newer
            maps = [text for _, _, text in self._old_maps()]
            return itertools.chain(maps, self._observed.parts())

    def _old_maps(self) -> list[tuple[int, dict[str, Any], str]]:
        """Return the newest maps that are no longer among the kept records; they come first."""
        if self._floor is not None and not self._maps:
            return [(0, self._floor, record_text(self._floor))]
        return [one for one in self._maps.values() if one[0] < self._observed.oldest]

    def refuse(self, sender: str, problems: Sequence[str]) -> None:
        """Count messages, or parts of them, that were left out because they were wrong."""
        if not problems:
            return
        with self._lock:
            first = not self.refused
            self.refused += len(problems)
            self.refusal = shorten(f"{sender}: {problems[-1]}", MAX_REFUSAL_LENGTH)
        if first:  # a flood of them is only counted
            logger.warning("%s: left out: %s", self.name, self.refusal)
        self._on_change(self)

    def set_stale(self, since: int | None) -> None:
        """Set when the machine's program disappeared; None if it is there."""
        self.stale = since
        self._on_change(self)

    def set_notes(self, notes: list[RunNote]) -> None:
        """Set the notes that are kept beside no recording, after any change of the run's notes."""
        self.notes = notes
        self.noted += 1
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
            return self._events.after(seq)

    def snapshot(self, *, short: bool = False) -> tuple[int, str]:
        """Return the newest event's number and everything a new page needs, as JSON.

        Args:
            short: Leave out the events, for pages that are too far behind.
        """
        seq, parts = self.snapshot_parts(short=short)
        return seq, "".join(parts)

    def snapshot_parts(self, *, short: bool = False) -> tuple[int, Iterator[str]]:
        """Return the number and the parts of the text that `snapshot` returns."""
        with self._lock:
            base = json.dumps((self._now if short else self._base).data)
            events = iter(()) if short else self._events.parts()
            seq = self._seq
            head = json.dumps({**self._facts(), "seq": seq, "problems": self.problems})
        return seq, itertools.chain(
            [f'{head[:-1]}, "base": {base}, "events": ['], with_commas(events), ["]}"]
        )

    def events(self) -> Iterable[dict[str, Any]]:
        """Return the kept events, a list unless they are packed; it can be iterated repeatedly."""
        with self._lock:
            return self._events.records()

    def history(self) -> tuple[dict[str, Any], Iterable[dict[str, Any]]]:
        """Return a copy of the state before the kept events, and these events, consistently."""
        with self._lock:
            copy: dict[str, Any] = json.loads(json.dumps(self._base.data))
            return copy, self._events.records()

    def active(self) -> list[str]:
        """Return the paths of the running states."""
        with self._lock:
            return self._now.active()

    def questions(self) -> dict[str, dict[str, Any]]:
        """Return path -> question for unanswered questions, the oldest first."""
        with self._lock:
            return self._now.questions()

    def sender_of(self, goal_id: str) -> str | None:
        """Return the path of the state that sent a goal; None if none did."""
        with self._lock:
            goal = self._now.data["goals"].get(goal_id)
        return None if goal is None else str(goal["path"])

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
            "refused": self.refused,
            "refusal": self.refusal,
            "noted": self.noted,
        }

    def _set_record(self, record: StateRecord) -> None:
        if record != self.record:
            self.record = record
            self._row = None
            self.revision += 1

    def _append(self, record: dict[str, Any], limit: int = MAX_KEPT_EVENTS) -> None:
        self._seq = record["seq"]
        if not self.recorded and (full := self._full_for(record)):
            self.refused += 1
            self.refusal = full
            return
        record = with_progress(record, self._now.data["goals"])
        self._now.fold(record)
        self._fold_row(record)
        self._events.append(self._seq, record, record_text(record))
        # The oldest events move from the queue into the base, so base and queue make up the run.
        while not self.recorded and (
            len(self._events) > limit or self._events.size > self._budget()
        ):
            self._folded, old = self._events.popleft()
            self._base.fold(old)

    def _fold_row(self, record: dict[str, Any]) -> None:
        """Keep the row up to date; after a resume it is made anew from all events."""
        if self.record is not None and record["path"] == self.record.path:
            if record["kind"] == "Started":
                self._row = RowFold(self.record)
            elif record["kind"] == "Recovered":
                self._row = None
        if self._row is not None:
            self._row.add(record)

    def row(self) -> dict[str, Any]:
        """Return the row of the newest run in a list (`RowFold.row`); its structure is known."""
        with self._lock:
            record = self.record
            assert record is not None
            if self._row is None:
                self._row = RowFold(record)
                for event in newest_run(list(self._events.records()), record.path):
                    self._row.add(event)

            def cause() -> str:
                if self._cause[0] != self._seq:
                    self._cause = self._seq, first_cause(record, self._events.records())
                return self._cause[1]

            return self._row.row(cause)

    def newest_events(self, prefix: str, most: int) -> list[dict[str, Any]]:
        """Return the newest kept events whose kind begins with `prefix`, oldest first."""
        with self._lock:
            kinds = (one for one in self._events.reversed() if one["kind"].startswith(prefix))
            return list(itertools.islice(kinds, most))[::-1]

    def newest_observed(self, what: str, most: int) -> list[dict[str, Any]]:
        """Return the newest kept records of robot topics of one kind, oldest first."""
        with self._lock:
            old = (record for _, record, _ in reversed(self._old_maps()))
            records = itertools.chain(self._observed.reversed(), old)
            return list(itertools.islice((r for r in records if r["what"] == what), most))[::-1]

    def _full_for(self, record: dict[str, Any]) -> str:
        """Return why there is no room for what an event adds for good; "" if there is."""
        now, path = self._now.data, record["path"]
        if path not in now["states"] and len(now["states"]) >= MAX_STATES:
            return f"events: got more than {MAX_STATES:,} states; expected fewer."
        if record["kind"] == "UserdataWritten" and len(now["userdata"]) >= MAX_KEYS:
            name = f"{path.rpartition('/')[0] or path} {record['key']}"
            if name not in now["userdata"]:
                return f"events: got more than {MAX_KEYS:,} userdata keys; expected fewer."
        if record["kind"] == "GoalSent" and len(now["goals"]) >= MAX_GOALS:
            return f"events: got more than {MAX_GOALS:,} running goals; expected fewer."
        return ""


def _begins_in_the_middle(history: dict[str, Any]) -> bool:
    """Return whether a server knows only its own part of a run that another process began."""
    base, events = history.get("base"), history["events"]
    is_first = not base or base["started"] is None
    first = next(iter(events), None)
    return is_first and first is not None and bool(first["kind"] == "Recovered")


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
        self._version = 0  # number of changes

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
                self._machines[name] = Machine(
                    name, self._changed, self._keep, self._floor, self._budget
                )
            return self._machines[name]

    def _budget(self) -> int:
        """The limit for the text of the kept events of one machine."""
        return min(MAX_KEPT_BYTES, MAX_TOTAL_BYTES // max(1, len(self._machines)))

    def _keep(self, machine: Machine) -> str:
        """Keep the machine of a previous program under its name and start time."""
        began = datetime.fromtimestamp(machine.summary()["started"] / 1e9).astimezone()
        with self._lock:
            earlier = [name for name, one in self._machines.items() if one.after == machine.name]
            for name in earlier[: max(0, len(earlier) - MAX_KEPT_RUNS + 1)]:
                del self._machines[name]
            first = f"{machine.name}, run of {began:%H:%M:%S}"
            # Programs can be started twice in a second.
            names = (f"{first} ({n})" if n > 1 else first for n in itertools.count(1))
            machine.name = next(name for name in names if name not in self._machines)
            self._machines[machine.name] = machine
            self._count_change(machine)
        return machine.name

    def load(self, name: str, recording: Recording) -> Machine:
        """Show a recording under a name, in place of what was shown there; return its machine."""

        def on_change(machine: Machine) -> None:
            if self._machines.get(name) is machine:
                self._changed(machine)

        # Others look at it when it is complete: a large recording takes long.
        machine = Machine(name, on_change, self._keep, self._floor, self._budget)
        machine.load(recording, packs=True)
        with self._lock:
            self._machines[name] = machine
        self._changed(machine)
        return machine

    def forget(self, name: str) -> None:
        """Remove a machine."""
        with self._lock:
            self._machines.pop(name, None)

    def sender_of(self, goal_id: str) -> str:
        """Return machine and state that have sent a goal, as text; "" if none has."""
        with self._lock:
            machines = list(self._machines.values())
        for machine in machines:
            path = machine.sender_of(goal_id)
            if path is not None:
                return f"{machine.name}: {path}"
        return ""

    def summaries(self) -> list[dict[str, Any]]:
        """Return the summaries of all machines, sorted by name."""
        with self._lock:
            machines = sorted(self._machines.items())
        return [machine.summary() for _, machine in machines if machine.record is not None]

    def changed_since(self, version: int) -> tuple[int, list[dict[str, Any]], set[str]]:
        """Return what a list of machines needs that was right after change number `version`.

        Returns:
            The number of the newest change, the summaries of the machines that have changed since,
            and the names of all machines.
        """
        with self._lock:
            newest = self._version
            known = {name: one for name, one in self._machines.items() if one.record is not None}
        changed = [one for one in known.values() if one.version > version]
        changed.sort(key=lambda one: one.name)
        return newest, [one.summary() for one in changed], set(known)

    def listen(self, listener: Callable[[Machine], object]) -> None:
        """Call `listener` after every change of a machine."""
        self._listeners.append(listener)

    def _count_change(self, machine: Machine) -> None:
        self._version += 1
        machine.version = self._version

    def _changed(self, machine: Machine) -> None:
        with self._lock:
            self._count_change(machine)
        for listener in list(self._listeners):  # a copy: others may be added meanwhile
            listener(machine)
