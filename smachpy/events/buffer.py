"""Event buffers: a machine's events are kept now and read later, at the least cost to the machine.

    buffer = machine.event_buffer()
    machine.execute()
    for record in buffer.read():
        ...

A listener (`Container.subscribe`) is called at each event and blocks the machine. A buffer takes
half a microsecond for a transition; it builds the records when they are read, for instance in
another thread. Recordings and the feed of viewers use buffers.
"""

from __future__ import annotations

import sys
import threading
from collections import defaultdict
from dataclasses import dataclass, field
from itertools import repeat
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, TypeAlias

from smachpy import log
from smachpy.events import (
    Entered,
    GoalDone,
    GoalFeedback,
    GoalSent,
    Left,
    UserdataWritten,
    to_record,
)
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actionlib_core.clock import Clock
    from smachpy.events import Event

__all__ = ["EventBuffer"]

SubscriberKind: TypeAlias = Literal["listeners", "buffers"]

LONGEST = 100_000
"""Number of entries that wait for a reader. An entry is one event, or a transition: two events."""

SLOTS = 5
"""Number of elements of an entry. Entries lie in one flat list: a tuple for each would cost the
machine more than everything else, mostly in Python's garbage collector. `list.extend` is atomic, so
the machine takes no lock.

    time [s], path of the container, step that ended or None, its outcome, step that begins or None
    None, event or record or a note (`_Begin`, `_Dropped`), None, None, None
"""

NOTHING = (None, None, None)

_CHANGING: tuple[type, ...] = (UserdataWritten, GoalSent, GoalFeedback, GoalDone)
"""Events with values that the user may change later: they become records at once."""

SLACK = 2_000
"""Number of entries above the limit before they are thinned out again."""

_new = tuple.__new__  # the `__new__` of a NamedTuple takes longer than everything else here
_ROUNDS = 256  # transitions between two checks of the limit
_SAME_NS = 1_000_000  # smaller steps back of the wall clock are errors of its reading


class _Begin(NamedTuple):
    """A note in the entries: from here on the buffer's machine has this path."""

    path: str


class _Dropped(NamedTuple):
    """A note in the entries: this number of events was dropped here."""

    events: int


class Buffered(Protocol):
    """The part of a container that a buffer uses."""

    def _smachpy_attach(self, kind: SubscriberKind, subscriber: object) -> None: ...
    def _smachpy_detach(self, kind: SubscriberKind, subscriber: object) -> None: ...


class EventBuffer:
    """The events of a container and of all below it, from now on; made by `Container.event_buffer`.

    Args:
        machine: The container.
        on_news: Called when there is something to read, and not again until `read` has found
            nothing more. It is called in the machine's thread and blocks it: only wake a thread
            that reads.
        limit: Number of entries that are kept in full. If they are not read, later ones are thinned
            out (`thin`), so that what is kept still shows what is active in the end. Gaps in `seq`
            show it.
        name: Path of the machine in the records, "/SM_ROOT"; "" keeps its own.

    Attributes:
        dropped: Number of events dropped so far.

    Threads: the machine's threads write; `read` may be called from any thread, one at a time.
    """

    def __init__(
        self,
        machine: Buffered,
        on_news: Callable[[], object] | None = None,
        *,
        limit: int = LONGEST,
        name: str = "",
    ) -> None:
        self.dropped = 0
        self.quiet = True
        self._entries: list[Any] = []  # see `SLOTS`
        self._most = limit * SLOTS
        self._full = self._most + SLACK * SLOTS
        self._cut = threading.Lock()  # held while entries are taken away
        self._missing = 0
        self.path = ""
        self._on_news = on_news
        self._name = name
        self._read_path = ""
        self._resumed: set[str] = set()  # states that an earlier process had entered
        self._lock = threading.Lock()
        self._seq = 0
        self._clock: Clock | None = None
        self._offset_ns = 0
        self._last_ns = 0
        self._machine = machine
        machine._smachpy_attach("buffers", self)

    def close(self) -> None:
        """Stop taking events; those in the buffer can still be read. May be called twice."""
        self._machine._smachpy_detach("buffers", self)

    def read(self) -> list[dict[str, Any]]:
        """Return the records (`smachpy.events.to_record`) since the last call, in order.

        Each has `seq`, its number in this buffer from 1; dropped events are counted. The first one
        after a gap has `dropped`, the number of events that are missing before it.
        """
        with self._lock:
            found = self._take_all()
            if not found:
                self.quiet = True
                # A writer appends first and reads `quiet` then; here it is the other way round. So
                # an entry that comes now is found here, or its writer calls `on_news`.
                found = self._take_all()
                if not found:
                    return []
                self.quiet = False
            self._set_clock()
            places = range(0, len(found), SLOTS)
            return [
                self._number(record)
                for at in places
                for record in self._records(found, at)
                if not self._is_known(record)
            ]

    # -- writing, called by the machine --------------------------------------------------------

    def take(self, event: Event) -> None:
        """Append an event."""
        self.put((None, to_record(event) if isinstance(event, _CHANGING) else event, *NOTHING))

    def put(self, entry: tuple[Any, ...]) -> None:
        """Append an entry (see `SLOTS`) and notify the reader."""
        # No lock: `extend` is atomic, and readers take entries from the front under `_cut`.
        entries = self._entries
        entries.extend(entry)
        if len(entries) >= self._full:
            self._thin()
        if self.quiet:
            self.ring()

    def room(self) -> tuple[Iterator[None], Callable[[tuple[Any, ...]], object]]:
        """Return an iterator over the free entries, and the function that appends one."""
        if self._full <= len(self._entries):
            self._thin()
        free = (self._full - len(self._entries)) // SLOTS
        return repeat(None, max(1, min(free, _ROUNDS))), self._entries.extend

    def _thin(self) -> None:
        """Thin out the entries above the limit."""
        # Only entries beyond `limit` are thinned out, so that a reader that is a little late gets
        # everything. Entries that are appended meanwhile follow the slice that is replaced.
        with self._cut:
            tail = self._entries[self._most :]
            if self._most + len(tail) < self._full:
                return  # the reader, or another thread of the machine, has made room
            thinned, dropped = thin(tail)
            self._entries[self._most : self._most + len(tail)] = thinned
            self.dropped += dropped
            # At least as much room again as was kept, so that thinning out stays rare.
            self._full = self._most + len(thinned) + max(SLACK * SLOTS, len(thinned))

    def ring(self) -> None:
        """Notify the reader."""
        self.quiet = False
        if self._on_news is not None:
            try:
                self._on_news()
            except Exception as error:  # noqa: BLE001  the user's: logged, the machine goes on
                log.log_exception(
                    f"buffer of {self.path}: on_news raised {error_text(error)}", error
                )

    def begin(self, path: str, clock: Clock) -> None:
        """Note the machine's path and clock at the start of a run."""
        self._clock = clock
        if path != self.path:
            self.path = path
            self._entries.extend((None, _Begin(path), *NOTHING))

    # -- reading -------------------------------------------------------------------------------

    def _set_clock(self) -> None:
        """Measure the offset of the wall clock from the monotonic clock.

        Entries have the monotonic time only: one look at a clock for each transition is enough.
        """
        clock = self._clock
        if clock is None:
            return
        # Of three readings the fastest is the most exact one.
        tries = []
        for _ in range(3):
            before, stamp, after = clock.now(), clock.time_ns(), clock.now()
            tries.append((after - before, stamp - round((before + after) / 2 * 1e9)))
        _, self._offset_ns = min(tries)

    def _stamp_of(self, t: float) -> int:
        stamp = self._offset_ns + round(t * 1e9)
        return self._last_ns if 0 < self._last_ns - stamp < _SAME_NS else stamp

    def _take_all(self) -> list[Any]:
        with self._cut:
            # A copy and a deletion of the same length: entries that are appended in between stay.
            entries = self._entries
            found = entries[:]
            del entries[: len(found)]
            self._full = self._most + SLACK * SLOTS
            return found

    def _records(self, found: list[Any], at: int) -> Iterator[dict[str, Any]]:
        t, what, left, outcome, entered = found[at : at + SLOTS]
        if t is None:
            if isinstance(what, _Begin):
                self._read_path = what.path
            elif isinstance(what, _Dropped):
                self._seq += what.events
                self._missing += what.events
            else:
                yield what if type(what) is dict else to_record(what)
            return
        stamp = self._stamp_of(t)
        if left is not None:
            path = f"{what}/{left.label}"
            yield {"kind": "Left", "path": path, "t": t, "stamp_ns": stamp, "outcome": outcome}
        if entered is not None:
            path = f"{what}/{entered.label}"
            yield {"kind": "Entered", "path": path, "t": t, "stamp_ns": stamp}

    def _is_known(self, record: dict[str, Any]) -> bool:
        """Return whether this is the `Entered` of a state that an earlier process had entered."""
        kind, path = record["kind"], record["path"]
        if kind == "Recovered":
            self._resumed = {path for path, _ in record["active"]}
        if not self._resumed or kind not in {"Entered", "Left", "Failed"}:
            return False
        known = path in self._resumed
        self._resumed.discard(path)
        return known and kind == "Entered"

    def _number(self, record: dict[str, Any]) -> dict[str, Any]:
        self._seq += 1
        record["seq"] = self._seq
        if self._missing:
            record["dropped"], self._missing = self._missing, 0
        self._last_ns = record["stamp_ns"]
        if self._name:
            record["path"] = self._named(record["path"])
            if record["kind"] == "Recovered":
                record["active"] = [[self._named(path), at] for path, at in record["active"]]
        return record

    def _named(self, path: str) -> str:
        return self._name + path.removeprefix(self._read_path)


class RawEventBuffer(EventBuffer):
    """A buffer of the events themselves, for a reader in the same process.

    It never drops any. The values in them are the machine's own objects, as for a listener.

    Args:
        machine: The container.
    """

    def __init__(self, machine: Buffered) -> None:
        super().__init__(machine, limit=sys.maxsize)

    def take(self, event: Event) -> None:
        """Append an event."""
        self._entries.extend((None, event, *NOTHING))

    def events(self) -> list[Event]:
        """Return the events since the last call, in order."""
        with self._lock:
            self._set_clock()
            found = iter(self._take_all())
            events: list[Event] = []
            last, stamp = None, 0
            # The step that began last mostly ends next, so its path is kept.
            base = step = path = None
            for t, what, left, outcome, entered in zip(*[found] * SLOTS, strict=True):
                if t is None:
                    if type(what) is not _Begin:
                        events.append(what)
                    continue
                if t != last:
                    last, stamp = t, self._stamp_of(t)
                if left is not None:
                    if left is not step or what is not base:
                        path = f"{what}/{left.label}"
                    events.append(_new(Left, (path, t, stamp, outcome)))
                if entered is not None:
                    base, step, path = what, entered, f"{what}/{entered.label}"
                    events.append(_new(Entered, (path, t, stamp)))
            return events


_OPENS = {"Started": "", "Recovered": "", "Entered": "", "GoalSent": "goal of "}
_CLOSES = {"Finished": "", "Left": "", "Failed": "", "GoalDone": "goal of "}
_WITHIN = {
    **dict.fromkeys(("PreemptRequested", "PreemptServiced", "Abandoned"), ""),
    **dict.fromkeys(("Retried", "Paused", "Resumed"), ""),
    **dict.fromkeys(("QuestionAsked", "QuestionAnswered"), ""),
    "Iterated": "item of ",
    "GoalFeedback": "goal of ",
    "UserdataWritten": "userdata of ",
}
"""Kind -> prefix of the path in the key under which `thin` keeps events of this kind."""


@dataclass(slots=True, eq=False)
class _Kept:
    """The places of the events of one state, or of its goals, that are kept.

    Attributes:
        first: The end of a visit that had begun before all others; -1 for none.
        opened: The begin of the newest visit.
        closed: Its end.
        within: Slot -> the newest event of that slot since then.
    """

    first: int = -1
    opened: int = -1
    closed: int = -1
    within: dict[str, int] = field(default_factory=dict)

    def open(self, place: int) -> None:
        self.opened, self.closed = place, -1
        self.within.clear()

    def close(self, place: int) -> None:
        if self.opened < 0 and self.first < 0:
            self.first = place
        else:
            self.closed = place
        self.within.clear()


def thin(entries: Sequence[Any]) -> tuple[list[Any], int]:
    """Drop the events between the oldest and the newest visit of each state.

    Kept are, for every state, the end of the visit that was active at the beginning, the newest
    visit, and the newest events of each kind since then; for every key of userdata the newest
    value; and the newest goal. A reader of these, in order, knows what is active now and sees whole
    visits; only those in between are missing.

    Args:
        entries: Elements, see `SLOTS`; they may have been thinned out before.

    Returns:
        The elements that are kept, with notes of the gaps, and the number of dropped events.
    """
    found: defaultdict[str, _Kept] = defaultdict(_Kept)
    newest = -1  # always kept: a gap is shown by the event that follows it
    for place, (_, what, left, _, entered) in enumerate(_single_events(entries)):
        if left is not None:
            found[f"{what}/{left.label}"].close(place)
        elif entered is not None:
            found[f"{what}/{entered.label}"].open(place)
        elif isinstance(what, (_Begin, _Dropped)):
            continue
        else:
            _find(what, place, found)
        newest = place
    kept = {newest}.union(
        *((one.opened, one.closed, one.first, *one.within.values()) for one in found.values())
    )
    return _without_the_rest(entries, kept)


def _single_events(entries: Sequence[Any]) -> Iterator[tuple[Any, ...]]:
    """Yield the entries; one that has two events becomes two."""
    for entry in zip(*[iter(entries)] * SLOTS, strict=True):
        t, what, left, outcome, entered = entry
        if left is not None and entered is not None:
            yield t, what, left, outcome, None
            yield t, what, None, None, entered
        else:
            yield entry


def _find(what: Any, place: int, found: dict[str, _Kept]) -> None:
    """Add the place of an event or record to `found`."""
    if type(what) is dict:
        kind, path = what["kind"], what["path"]
    else:
        kind, path = type(what).__name__, what.path
    if kind in _OPENS:
        found[_OPENS[kind] + path].open(place)
    elif kind in _CLOSES:
        found[_CLOSES[kind] + path].close(place)
    elif kind in _WITHIN:
        slot = f"key {what['key']}" if kind == "UserdataWritten" else kind
        found[_WITHIN[kind] + path].within["Paused" if kind == "Resumed" else slot] = place


def _without_the_rest(entries: Sequence[Any], kept: set[int]) -> tuple[list[Any], int]:
    thinned: list[Any] = []
    begun: list[Any] = []  # the last `_Begin` note, needed by the next entry that is kept
    dropped = missing = 0  # missing: since the last entry that is kept
    for place, entry in enumerate(_single_events(entries)):
        what = entry[1]
        if isinstance(what, _Begin):
            begun = list(entry)
        elif isinstance(what, _Dropped):
            missing += what.events
        elif place not in kept:
            missing, dropped = missing + 1, dropped + 1
        else:
            thinned += begun + ([None, _Dropped(missing), *NOTHING] if missing else [])
            thinned += entry
            begun, missing = [], 0
    return thinned + begun, dropped
