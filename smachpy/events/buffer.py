"""Event buffers: a machine's events are kept now and read later, at the least cost to the machine.

    buffer = machine.event_buffer()
    machine.execute()
    for record in buffer.read():
        ...

A listener (`Container.subscribe`) is called at each event and blocks the machine. A buffer only
keeps the event; it builds the records when they are read, for instance in another thread.
Recordings and the feed of viewers use buffers.
"""

from __future__ import annotations

import sys
import threading
from collections import defaultdict
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol, TypeAlias

from actionlib_core.clock import wall_time
from smachpy.base import log
from smachpy.events import (
    GoalDone,
    GoalFeedback,
    GoalSent,
    UserdataWritten,
    to_record,
)
from smachpy.events.steady import SteadyStamps
from smachpy.exceptions import error_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actionlib_core.clock import Clock
    from smachpy.events import Event

__all__ = ["EventBuffer"]

SubscriberKind: TypeAlias = Literal["listeners", "buffers"]

MAX_BUFFER_EVENTS = 100_000
"""Number of events that wait for a reader."""

_CHANGING = frozenset({UserdataWritten, GoalSent, GoalFeedback, GoalDone})
"""Events with values that the user may change later: they become records at once."""

SLACK = 2_000
"""Number of events above the limit before they are thinned out again."""


class _Begin(NamedTuple):
    """A note among the events: from here on the buffer's machine has this path."""

    path: str


class _Dropped(NamedTuple):
    """A note among the events: this number of events was dropped here."""

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
        limit: Number of events that are kept in full. If they are not read, later ones are thinned
            out (`thin`), so that what is kept still shows what is active in the end. Gaps in `seq`
            show it.
        name: Path of the machine in the records, "/SM_ROOT"; "" keeps its own.

    Attributes:
        dropped: Number of events dropped so far.
        on_full: Called in the machine's thread when the limit is reached; it may wait for the
            reader. If it returns True, nothing is thinned out. None: there is none.

    Threads: the machine's threads write; `read` may be called from any thread, one at a time.
    """

    def __init__(
        self,
        machine: Buffered,
        on_news: Callable[[], object] | None = None,
        *,
        limit: int = MAX_BUFFER_EVENTS,
        name: str = "",
    ) -> None:
        self.dropped = 0
        self.on_full: Callable[[], bool] | None = None
        self._is_quiet = True
        self._entries: list[Any] = []  # events, records and notes
        self._most = limit
        self._full = limit + SLACK
        self._cut = threading.Lock()  # of the entries, and of whether the reader waits for news
        self._missing = 0
        self.path = ""
        self._on_news = on_news
        self._name = name
        self._read_path = ""
        self._resumed: set[str] = set()  # states that an earlier process had entered
        self._lock = threading.Lock()
        self._seq = 0
        self._clock: Clock | None = None
        self._steady = SteadyStamps()
        self._machine = machine
        machine._smachpy_attach("buffers", self)

    def close(self) -> None:
        """Stop taking events; those in the buffer can still be read. May be called twice."""
        self._machine._smachpy_detach("buffers", self)

    def read(self, most: int = sys.maxsize) -> list[dict[str, Any]]:
        """Return the records (`smachpy.events.to_record`) since the last call, in order.

        Each has `seq`, its number in this buffer from 1; dropped events are counted. The first one
        after a gap has `dropped`, the number of events that are missing before it.

        Args:
            most: The most entries that are read.
        """
        with self._lock:
            # What is known already is left out. If that was all, it looks for more: `take` tells of
            # news only after a look that has found nothing.
            while found := self._take_all(most):
                if self._clock is not None:
                    wall_time(self._clock).check()
                records = [
                    self._number(record)
                    for record in self._records(found)
                    if not self._is_known(record)
                ]
                if records:
                    return records
            return []

    def has_room(self) -> bool:
        """Return whether half of the limit is free."""
        return len(self._entries) <= self._most / 2

    # -- writing, called by the machine --------------------------------------------------------

    def take(self, event: Event) -> None:
        """Append an event and notify the reader."""
        entry = to_record(event) if type(event) in _CHANGING else event
        with self._cut:
            self._entries.append(entry)
            is_full = len(self._entries) >= self._full
            rings, self._is_quiet = self._is_quiet, False
        if is_full:
            self._thin()
        if rings:
            self._ring()

    def _thin(self) -> None:
        """Thin out the entries above the limit."""
        if self.on_full is not None and self.on_full():
            return
        # Only entries beyond `limit` are thinned out, so that a reader that is a little late gets
        # everything.
        with self._cut:
            if len(self._entries) < self._full:
                return  # the reader, or another thread of the machine, has made room
            thinned, dropped = thin(self._entries[self._most :])
            self._entries[self._most :] = thinned
            self.dropped += dropped
            # At least as much room again as was kept, so that thinning out stays rare.
            self._full = self._most + len(thinned) + max(SLACK, len(thinned))

    def _ring(self) -> None:
        """Notify the reader."""
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
            with self._cut:
                self._entries.append(_Begin(path))

    # -- reading -------------------------------------------------------------------------------

    def _take_all(self, most: int = sys.maxsize) -> list[Any]:
        with self._cut:
            found, self._entries = self._entries[:most], self._entries[most:]
            self._full = max(self._most, len(self._entries)) + SLACK
            self._is_quiet = not found
            return found

    def _records(self, found: list[Any]) -> Iterator[dict[str, Any]]:
        for what in found:
            if isinstance(what, _Begin):
                self._read_path = what.path
            elif isinstance(what, _Dropped):
                self._seq += what.events
                self._missing += what.events
            else:
                yield what if type(what) is dict else to_record(what)

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

    def now_ns(self) -> int:
        """Return the present time as in the stamps of the records [ns since the epoch].

        0 before the first run.
        """
        clock = self._clock
        if clock is None:
            return 0
        return self._steady.at(clock.now()) or clock.time_ns()

    def steady(self, record: dict[str, Any]) -> dict[str, Any]:
        """Return a record of another source, with `t`, with a stamp as those of the events."""
        stamp_ns = self._steady.at(record["t"])
        return {**record, "stamp_ns": stamp_ns} if stamp_ns else record

    def _number(self, record: dict[str, Any]) -> dict[str, Any]:
        self._steady.fix(record)
        self._seq += 1
        record["seq"] = self._seq
        if self._missing:
            record["dropped"], self._missing = self._missing, 0
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
        with self._cut:
            self._entries.append(event)

    def events(self) -> list[Event]:
        """Return the events since the last call, in order."""
        return [what for what in self._take_all() if type(what) is not _Begin]


_OPENS = {"Started": "", "Recovered": "", "Entered": "", "GoalSent": "goal of "}
_CLOSES = {"Finished": "", "Left": "", "Failed": "", "GoalDone": "goal of "}
_WITHIN = {
    **dict.fromkeys(("PreemptRequested", "PreemptServiced", "Abandoned"), ""),
    **dict.fromkeys(("Retried", "Noted", "ResourceUse", "Paused", "Resumed"), ""),
    **dict.fromkeys(("QuestionAsked", "QuestionAnswered", "Fired", "HeldBack"), ""),
    "Iterated": "item of ",
    "GoalFeedback": "goal of ",
    "UserdataWritten": "userdata of ",
}
"""Kind -> prefix of the path in the key under which `thin` keeps events of this kind."""


class _Kept:
    """The places of the events of one state, or of its goals, that are kept.

    Attributes:
        first: The end of a visit that had begun before all others; -1 for none.
        opened: The begin of the newest visit.
        closed: Its end.
        within: Slot -> the newest event of that slot since then.
    """

    def __init__(self) -> None:
        self.first = -1
        self.opened = -1
        self.closed = -1
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
    """Drop the events between the oldest and the newest visit of each state.

    Kept are, for every state, the end of the visit that was active at the beginning, the newest
    visit, and the newest events of each kind since then; for every key of userdata the newest
    value; and the newest goal. A reader of these, in order, knows what is active now and sees whole
    visits; only those in between are missing.

    Args:
        entries: Events, records and notes; they may have been thinned out before.

    Returns:
        The entries that are kept, with notes of the gaps, and the number of dropped events.
    """
    found: defaultdict[str, _Kept] = defaultdict(_Kept)
    newest = -1  # always kept: a gap is shown by the event that follows it
    for place, what in enumerate(entries):
        if not isinstance(what, (_Begin, _Dropped)):
            _find(what, place, found)
            newest = place
    kept = {newest}.union(
        *((one.opened, one.closed, one.first, *one.within.values()) for one in found.values())
    )
    return _without_the_rest(entries, kept)


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
    for place, what in enumerate(entries):
        if isinstance(what, _Begin):
            begun = [what]
        elif isinstance(what, _Dropped):
            missing += what.events
        elif place not in kept:
            missing, dropped = missing + 1, dropped + 1
        else:
            thinned += begun
            if missing:
                thinned.append(_Dropped(missing))
            thinned.append(what)
            begun, missing = [], 0
    return thinned + begun, dropped
