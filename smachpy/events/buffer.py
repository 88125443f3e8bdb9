"""A machine's events taken down now and read later: the way to hear of it that costs it least.

    buffer = machine.event_buffer()
    machine.execute()
    for record in buffer.read():
        ...

A listener (`Container.subscribe`) is called at each event and holds the machine up; a buffer takes
half a microsecond for a transition and builds its records when somebody reads them, in another
thread if you like. Recordings and the feed of viewers are made of it.
"""

from __future__ import annotations

import sys
import threading
from collections import defaultdict
from itertools import count, repeat
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

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

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actionlib_core.clock import Clock
    from smachpy.events import Event

__all__ = ["EventBuffer"]

LONGEST = 100_000
"""So many entries wait for a reader; an entry is an event, or a transition of two."""

SLOTS = 5
"""An entry is so many elements of a flat list, because a tuple for each would cost the machine more
than all the rest, mostly in Python's garbage collector. `list.extend` is one atomic step.

    time [s], path of the container, step that ended or None, its outcome, step that begins or None
    None, event or record or a note (`_Begin`, `_Dropped`), None, None, None
"""

NOTHING = (None, None, None)

_CHANGING: tuple[type, ...] = (UserdataWritten, GoalSent, GoalFeedback, GoalDone)
"""Events with values that may change later: they become records at once."""

SLACK = 2_000
"""So many entries more may be there before they are thinned out again."""

_new = tuple.__new__  # an event without its class's own `__new__`, which costs more than the rest
_ROUNDS = 256  # so many transitions between two looks at the limit
_SAME_NS = 1_000_000  # a wall clock that goes back by less than this was only read inexactly


class _Begin(NamedTuple):
    """Note: the buffer's machine has this path from here on."""

    path: str


class _Dropped(NamedTuple):
    """Note: so many events were dropped here."""

    events: int


class Buffered(Protocol):
    """What a buffer needs of its container."""

    def _smachpy_add_buffer(self, buffer: EventBuffer) -> None: ...
    def _smachpy_remove_buffer(self, buffer: EventBuffer) -> None: ...


class EventBuffer:
    """The events of a container and of all below it, from now on; made by `Container.event_buffer`.

    Args:
        machine: The container.
        on_news: Called when there is something to read, once until `read` has found nothing more;
            in the thread of the machine, which it holds up: let it wake a thread that reads.
        limit: So many entries wait as they are; when they are not read, those that come then are
            thinned out (`thin`): what is kept still says what goes on in the end. `read` shows it
            by gaps in `seq`.
        name: What to call the machine in the records, "/SM_ROOT"; "" leaves its own path.

    Attributes:
        dropped: So many events were dropped, until now.

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
        self._machine = machine
        self._on_news = on_news
        self._name = name
        self._read_path = ""
        self._goes_on: set[str] = set()  # states of an earlier process that were not entered yet
        self._lock = threading.Lock()
        self._seq = 0
        self._clock: Clock | None = None
        self._offset_ns = 0
        self._last_ns = 0

    def close(self) -> None:
        """Take nothing more down; what is there can still be read. A second call does nothing."""
        self._machine._smachpy_remove_buffer(self)

    def read(self) -> list[dict[str, Any]]:
        """Return the records (`smachpy.events.to_record`) since the last call, in order.

        Each has `seq`, the number of the event on this buffer, from 1; dropped events count. The
        first after a gap has `dropped`, so many are missing before it.
        """
        with self._lock:
            found = self._take_all()
            if not found:
                self.quiet = True
                # Whoever writes appends first and looks at `quiet` then: one sees the other.
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

    # -- for the machinery ---------------------------------------------------------------------

    def take(self, event: Event) -> None:
        """Take an event down."""
        self.put((None, to_record(event) if isinstance(event, _CHANGING) else event, *NOTHING))

    def put(self, entry: tuple[Any, ...]) -> None:
        """Append an entry, see `SLOTS`, and say so."""
        entries = self._entries
        entries.extend(entry)
        if len(entries) >= self._full:
            self._thin()
        if self.quiet:
            self.ring()

    def room(self) -> tuple[Iterator[None], Callable[[tuple[Any, ...]], object]]:
        """Return how often to append before asking again, and what to append with."""
        if self._full <= len(self._entries):
            self._thin()
        free = (self._full - len(self._entries)) // SLOTS
        return repeat(None, max(1, min(free, _ROUNDS))), self._entries.extend

    def _thin(self) -> None:
        """Drop what can be missed of what came after the limit."""
        with self._cut:
            tail = self._entries[self._most :]
            if self._most + len(tail) < self._full:
                return  # somebody else has made room
            thinned, dropped = thin(tail)
            self._entries[self._most : self._most + len(tail)] = thinned
            self.dropped += dropped
            self._full = self._most + len(thinned) + max(SLACK * SLOTS, len(thinned))

    def ring(self) -> None:
        """Say that there is something to read."""
        self.quiet = False
        if self._on_news is not None:
            try:
                self._on_news()
            except Exception as error:  # noqa: BLE001  a border: reported, the machine goes on
                log.log_exception(f"buffer of {self.path}: on_news raised {error!r}", error)

    def begin(self, path: str, clock: Clock) -> None:
        """Note where the machine runs and by which clock."""
        self._clock = clock
        if path != self.path:
            self.path = path
            self._entries.extend((None, _Begin(path), *NOTHING))

    # -- reading -------------------------------------------------------------------------------

    def _set_clock(self) -> None:
        """Find out how wall time follows from the clock's monotonic time now."""
        clock = self._clock
        if clock is None:
            return
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
        """Tell whether a record says that a state begins that an earlier process has begun."""
        kind, path = record["kind"], record["path"]
        if kind == "Recovered":
            self._goes_on = {path for path, _ in record["active"]}
        if not self._goes_on or kind not in {"Entered", "Left", "Failed"}:
            return False
        known = path in self._goes_on
        self._goes_on.discard(path)
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
    """A buffer that gives the events themselves, for a reader in the same process.

    It never drops any; the values in them are the machine's own, as a listener gets them.

    Args:
        machine: The container.
    """

    def __init__(self, machine: Buffered) -> None:
        super().__init__(machine, limit=sys.maxsize)
        machine._smachpy_add_buffer(self)

    def take(self, event: Event) -> None:
        """Take an event down."""
        self._entries.extend((None, event, *NOTHING))

    def events(self) -> list[Event]:
        """Return the events since the last call, in order."""
        with self._lock:
            self._set_clock()
            found = iter(self._take_all())
            events: list[Event] = []
            last, stamp = None, 0
            base = step = path = None  # what began last is mostly what ends next
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
"""Kind -> what comes before the path in the name of what it is about."""


class _Kept:
    """Places of the events of one state, or of its goals, that are kept.

    `first` is the end of a visit that had begun before the others, `opened` and `closed` are those
    of the newest visit, `within` is what was said since.
    """

    __slots__ = ("closed", "first", "opened", "within")

    def __init__(self) -> None:
        self.opened = self.closed = self.first = -1
        self.within: dict[str, int] = {}

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
    """Return the entries that are kept, with notes of what is missing, and how many events are.

    Of every state the end of the visit that was going on, the newest visit, and what was said since
    then; of every key of userdata the newest value; the newest goal. With those, in order, whoever
    reads knows what goes on now, and the visits that they see are whole; only the ones between are
    missing.

    Args:
        entries: Elements, see `SLOTS`; they may have been thinned out before.
    """
    found: defaultdict[str, _Kept] = defaultdict(_Kept)
    newest = -1  # is kept whatever it is: a gap is seen by what follows it
    # The place of an event is twice the number of its entry, one more if the entry has two.
    for place, (t, what, left, _, entered) in zip(count(0, 2), _each(entries), strict=False):
        if t is not None:
            if left is not None:
                found[f"{what}/{left.label}"].close(place)
            if entered is not None:
                found[f"{what}/{entered.label}"].open(place + 1)
            newest = place + (entered is not None)
        elif not isinstance(what, (_Begin, _Dropped)):
            _find(what, place, found)
            newest = place
    kept = {newest}.union(
        *((one.opened, one.closed, one.first, *one.within.values()) for one in found.values())
    )
    return _without_the_rest(entries, kept)


def _each(entries: Sequence[Any]) -> Iterator[tuple[Any, ...]]:
    return zip(*[iter(entries)] * SLOTS, strict=True)


def _find(what: Any, place: int, found: dict[str, _Kept]) -> None:
    """Note the place of an event or record."""
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
    begun: list[Any] = []  # a note that what is kept next needs
    dropped = missing = 0  # missing: since the last that is kept
    for place, entry in zip(count(0, 2), _each(entries), strict=False):
        t, what, left, outcome, entered = entry
        if t is None and isinstance(what, _Begin):
            begun = list(entry)
            continue
        if t is None and isinstance(what, _Dropped):
            missing += what.events
            continue
        parts: list[tuple[int, tuple[Any, ...]]] = [(place + (entered is not None), entry)]
        if left is not None and entered is not None:
            end, begin = (t, what, left, outcome, None), (t, what, None, None, entered)
            parts = [(place, end), (place + 1, begin)]
        for at, part in parts:
            if at not in kept:
                missing, dropped = missing + 1, dropped + 1
                continue
            thinned += begun + ([None, _Dropped(missing), *NOTHING] if missing else [])
            thinned += part
            begun, missing = [], 0
    return thinned + begun, dropped
