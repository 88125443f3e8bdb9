"""Recordings: one run in one file of JSON lines, appended during the run, readable after a crash.

The first line is the header: `format` "smachpy-run", `version`, `machine` (a
`smachpy.introspection.StateRecord`), `stamp_ns` and `base`, the `RunState` before the first event,
or null. A durable mission also has `run`, the name of its run: the process that resumes the mission
continues the file, or writes another file with the same `run`. Every further line is an event
(`smachpy.events.to_record`) with a number `seq`. Where events are missing, `seq` has a gap and the
next event has their number, `dropped`; the last visit of each state is never missing
(`events.buffer`). The last line, of kind "End", says that nothing follows: the numbers of `events`
and of `missing` ones, and what a list shows, so that lists read two lines of a file. It lacks if
the process died; a last line that a crash has cut off is ignored when reading.

Lines of kind "Observed" are not events of the machine but data of the robot's topics
(`smachpy.network.observations`), those of kind "Crossed" are what crossed the mission's border
(`smachpy.events.inputs`); with these, the header has `origin`, which says what ran.
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import json
import os
import threading
from collections import deque
from dataclasses import asdict, dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NotRequired, Protocol, TypedDict

from actionlib_core.clock import RealClock, SerialExecutor, current_clock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.checked_data import DataError, Stamp, checked
from actionlib_core.inputs.json_text import load_json
from actionlib_core.interfaces import get_message
from actionlib_core.interfaces._sources import BUNDLED
from actionlib_core.node import known_node
from actionlib_core.process.private_files import make_private_folder, open_private
from smachpy.base import log
from smachpy.events import record_text
from smachpy.events.inputs import (
    CROSSED,
    WHICH,
    Inputs,
    OriginFacts,
    Which,
    origin_facts,
)
from smachpy.events.introspection import MAX_NESTING, Described, StateRecord, describe
from smachpy.events.reading import OBSERVED, read_crossed, read_event, read_facts, read_observed
from smachpy.events.run_state import RAISED, RunState
from smachpy.events.steady import SteadyStamps, begun_root
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import IO, BinaryIO, Self, TextIO

    from smachpy.events.buffer import EventBuffer

FORMAT = "smachpy-run"
VERSION = 1
TYPES = "Types"
"""Kind of the records that hold definitions of the mission's own goal types."""
WAITING_OBSERVED = 1_000
"""Number of records of the robot's topics that wait to be written; then the oldest are dropped."""

WAITING_EVENTS = 100_000
"""Number of entries that wait to be written. A machine that is faster than the writer waits for it
then, or writes them itself in virtual time, where the writer runs only when the machine waits. If
the disk hangs, further ones are thinned out and counted."""

END = "End"
"""Kind of the last record."""

CLOSE_S = 2.0
"""`close` says after this time that it still writes [s]."""

HANGS_S = 10.0
"""A writer that gets on with nothing for so long hangs: nobody waits for it any longer [s]."""

WRITTEN_AT_ONCE = 1_000
"""Number of entries in one write."""

LARGEST = 1_000_000_000
"""Largest recording that is read [bytes]."""

STREAMED = 20_000_000
"""Recordings of more bytes are read event by event where that is enough."""

MAX_LINE_LENGTH = 32_000_000
"""Longest line of a recording [characters]; the header of 10,000 states has 5,000,000."""


class RecordingError(SmachError):
    """A recording cannot be written or read.

    Try: check the path and the space on the disk; a file from elsewhere may be no recording.

    Attributes:
        path: The file.
    """

    def __init__(self, path: str | Path, problem: str) -> None:
        self.path = str(path)
        super().__init__(f"recording {str(path)!r}: {problem}")


@dataclass(slots=True)
class Recording:
    """A run that was read from a file.

    Attributes:
        path: The file.
        record: The machine.
        stamp_ns: When the recording began.
        base: The state of the run at its beginning; None if it began with the run.
        events: The records.
        cut: Whether the file ends in the middle of a line.
        wrong: What is left out as it has a wrong form, "line 7: ...".
        observed: Records of the robot's topics, numbered from 1 in `n`.
        made_ns: When it was really made; `stamp_ns` differs if the mission's time was virtual.
        definitions: Texts of the mission's own message types, as `interface_texts` returns them.
        run: Name of the run of a durable mission, which may be in several files; else "".
        inputs: Records of what crossed the mission's border (`smachpy.events.inputs`).
        origin: What ran (`smachpy.events.inputs`); None in older recordings.
    """

    path: Path
    record: StateRecord
    stamp_ns: int
    base: dict[str, Any] | None
    events: list[dict[str, Any]] = field(default_factory=list)
    cut: bool = False
    wrong: list[str] = field(default_factory=list)
    observed: list[dict[str, Any]] = field(default_factory=list)
    made_ns: int = 0
    definitions: dict[str, str] = field(default_factory=dict)
    run: str = ""
    inputs: list[dict[str, Any]] = field(default_factory=list)
    origin: dict[str, Any] | None = None

    @property
    def folded(self) -> int:
        """Number of the oldest events that were folded into `base` when it was read."""
        first = self.events[0] if self.events else {"seq": 1}
        return int(first["seq"]) - int(first.get("dropped", 0)) - 1

    @property
    def dropped(self) -> int:
        """Number of events that are missing between the recorded ones."""
        return sum(event.get("dropped", 0) for event in self.events)

    def history(self) -> dict[str, Any]:
        """Return it in the form of a server's history (`smachpy.network.feed`)."""
        return {
            "epoch": f"file {self.path.name} {self.stamp_ns}",
            "description": asdict(self.record),
            "base": self.base,
            "events": self.events,
            "observed": self.observed,
            "problems": [],
            "control": None,
            "run": self.run,
        }


class Recorded(Described, Protocol):
    """The part of a container that a recording uses."""

    userdata: Any

    def event_buffer(
        self, on_news: Callable[[], object] | None = None, *, limit: int = 0
    ) -> EventBuffer:
        """Return a buffer of its events."""


class Recorder:
    """Writes the events of a machine to a file; a context manager.

    Args:
        path: The file. It must not exist yet, unless it holds the durable run that `machine`
            resumes: then the rest of the run is appended.
        machine: The machine.
        run: Name of the durable run, `smachpy.durable.recorder.Recorder.run`; else "".
        inputs: Which inputs of the mission are recorded: "seen", what reached its code, large
            messages as hash and summary; "all", those too; "none".
        origin: How to begin the mission again: its name, its arguments and so on.

    Attributes:
        path: The file.
        earlier: The records that were already in the file.

    Raises:
        RecordingError: the file exists, cannot be made, or its content cannot be read; or `origin`
            is no `smachpy.events.inputs.MissionFacts`.

    Threads: another thread writes; the machine waits for it only if 100,000 events wait.
    """

    def __init__(
        self,
        path: str | Path,
        machine: Recorded,
        *,
        run: str = "",
        inputs: Which = "seen",
        origin: Mapping[str, Any] | None = None,
    ) -> None:
        if inputs not in WHICH:
            raise RecordingError(path, f"inputs: got {inputs!r}; expected one of {WHICH}.")
        self.path = Path(path)
        self.earlier: list[dict[str, Any]] = []
        clock = current_clock()
        self._executor = SerialExecutor(clock, f"recording {self.path.name}")
        self._failed = self._closed = False
        self._unwritten = 0
        self._written = 0  # records, by which `close` and the machine see that the writer gets on
        self._is_real = isinstance(clock, RealClock)
        self._writing = threading.Lock()
        self._is_stalled = False
        self._has_room = clock.event(f"room in the recording {self.path.name}")
        self._facts = _Facts()
        node = known_node()  # not made for this: a machine may need no network at all
        try:
            if run and run_of(self.path) == run:
                self._file = self._continued()
            else:
                made_ns = RealClock().time_ns()
                record = describe(machine)
                facts = None
                if inputs != "none":
                    userdata = {key: machine.userdata[key] for key in machine.userdata.keys()}  # noqa: SIM118
                    space = "" if node is None else node.namespace
                    facts = origin_facts(clock, space, origin or {}, userdata, inputs)
                    checked(OriginFacts, facts, known_only=True)  # else nobody could read the file
                self._file = self._begun(
                    header_line(record, clock.time_ns(), made_ns=made_ns, run=run, origin=facts)
                )
        except DataError as error:
            raise RecordingError(path, f"origin: {error}.") from error
        except FileExistsError as error:
            raise RecordingError(
                path, "the file exists; expected a new name, runs are never overwritten."
            ) from error
        except OSError as error:
            raise RecordingError(path, f"cannot write: {error.strerror or error}.") from error
        self._observed: deque[dict[str, Any]] = deque(maxlen=WAITING_OBSERVED)
        self._types: set[str] = set()  # goal types whose definitions were looked up
        self._inputs = None
        if inputs != "none":
            name = "" if node is None else node.full_name
            self._inputs = Inputs(inputs, clock, name, self._on_news)
        self._buffer = machine.event_buffer(self._on_news, limit=WAITING_EVENTS)
        self._buffer.on_full = self._make_room

    def _begun(self, header: str) -> IO[str]:
        """Open a new file with this header; none is left if that cannot be written."""
        make_private_folder(self.path.parent)
        # "x": an existing file is never overwritten, even if two processes begin at once.
        file = open_private(self.path, "x")
        try:
            file.write(header)
            file.flush()  # readable from now on, also if the process is killed
        except BaseException:
            self.path.unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                file.close()
            raise
        notes_file(self.path).unlink(missing_ok=True)  # on an earlier file of that name
        return file

    def _continued(self) -> IO[str]:
        """Open the file to append after its last complete event; the rest is removed."""
        self.earlier = read_recording(self.path).events
        for event in self.earlier:
            self._facts.add(event)
        with self.path.open("rb+") as file:
            begin, line = _last_line(file)
            file.truncate(begin if _is_end(line) else begin + len(line))
        return self.path.open("a", encoding="utf-8")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Write the waiting records and the end mark, and close the file; may be called twice.

        Blocks: as long as the writer gets on; 10 s if the disk hangs.
        """
        if self._file.closed:
            return
        # No new events from here on; the last ones are written by one more call of `_write`.
        self._closed = True
        self._buffer.close()
        if self._inputs is not None:
            self._inputs.close()
        self._on_news()
        periods, before = 0, -1
        while not self._executor.join(CLOSE_S):
            periods, before = (1 if self._written != before else periods + 1), self._written
            if periods * CLOSE_S >= HANGS_S:
                log.logwarn(
                    f"recording {str(self.path)!r}: still being written, but the disk has taken "
                    f"nothing for {HANGS_S:g} s; the end of the run is lost if the program ends "
                    "now."
                )
                break
            log.loginfo(f"recording {str(self.path)!r}: the rest is still being written.")
        else:
            self._finish()
        if self._buffer.dropped:
            log.logwarn(
                f"recording {str(self.path)!r}: {self._buffer.dropped} events are missing; more "
                "came than could be written. Every state's last visit is there."
            )
        if self._unwritten:
            log.logwarn(f"recording {str(self.path)!r}: {self._unwritten} events are not in it.")

    def _finish(self) -> None:
        """Write the end mark and close the file."""
        try:
            if not self._failed:
                self._file.write(event_line(self._facts.end()))
            self._file.close()
        except OSError as error:
            self._fail(error)
            with contextlib.suppress(OSError):
                self._file.close()

    def _make_room(self) -> bool:
        """Wait in the machine's thread until the writer has taken what waits; tell whether.

        In virtual time, where the writer waits for the machine, this thread writes instead.
        """
        if self._failed or self._is_stalled:
            return False
        if not self._is_real:
            self._write()
            return True
        self._has_room.clear()
        before = self._written
        while not self._has_room.wait(HANGS_S):
            if self._written == before:
                self._is_stalled = True
                return False
            before = self._written
        return True

    @property
    def dropped(self) -> int:
        """Number of events that were not written: too many at once, or the disk failed."""
        return self._buffer.dropped + self._unwritten

    def observe(self, record: dict[str, Any]) -> None:
        """Write a record of `RobotTopics`; does nothing after `close`."""
        if not self._closed:
            self._observed.append(self._buffer.steady(record))
            self._on_news()

    def _on_news(self) -> None:
        self._executor.submit(self._write)

    def _write(self) -> None:
        """Write records until none are left."""
        with self._writing:
            self._write_all()

    def _write_all(self) -> None:
        while records := self._take():
            if self._failed:  # still read, so that the buffer does not fill up
                self._unwritten += len(records)
                continue
            try:
                types = self._new_types(records)
                self._file.write("".join(map(event_line, [*types, *records])))
                self._file.flush()
            except OSError as error:
                self._unwritten += len(records)
                self._fail(error)
                continue
            self._written += len(records)
            self._is_stalled = False
            for record in records:
                self._facts.add(record)
            if self._buffer.has_room():
                self._has_room.set()

    def _new_types(self, records: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
        """Yield the definitions of goal types that appear for the first time."""
        for record in records:
            goal = record.get("goal") if record["kind"] == "GoalSent" else None
            name = goal.get("$msg") if isinstance(goal, dict) else None
            if isinstance(name, str) and name not in self._types:
                self._types.add(name)
                if texts := interface_texts(name):
                    stamp_ns = record["stamp_ns"]
                    yield {"kind": TYPES, "path": "", "stamp_ns": stamp_ns, "definitions": texts}

    def _take(self) -> list[dict[str, Any]]:
        """Return what is to be written next."""
        found = self._buffer.read(WRITTEN_AT_ONCE)
        found += [self._observed.popleft() for _ in range(len(self._observed))]
        if self._inputs is not None:
            found += map(self._buffer.steady, self._inputs.take(WRITTEN_AT_ONCE))
        return found

    def _fail(self, error: OSError) -> None:
        if not self._failed:
            self._failed = True
            log.logerr(f"recording {str(self.path)!r}: ends here: {error.strerror or error}.")


class _Facts:
    """What the end mark says of the newest run in a file."""

    def __init__(self) -> None:
        self._events = self._missing = self._last_ns = 0
        self._first_ns: int | None = None
        self._root = ""
        self._outcome: str | None = None
        self._outages: list[Any] = []

    def add(self, record: dict[str, Any]) -> None:
        """Add a record, in order."""
        kind = record["kind"]
        if kind in _NO_EVENTS:
            return
        self._events += 1
        self._missing += record.get("dropped", 0)
        self._last_ns = record["stamp_ns"]
        if self._first_ns is None:
            self._first_ns = self._last_ns
        if root := begun_root(record, self._root):
            self._root, self._outcome = root, None
            self._outages = record.get("outages", [])
        elif kind == "Finished" and record["path"] == self._root:
            self._outcome = record["outcome"] or RAISED

    def end(self) -> dict[str, Any]:
        """Return the end mark."""
        return {
            "kind": END,
            "path": self._root,
            "stamp_ns": self._last_ns,
            "events": self._events,
            "missing": self._missing,
            "first_ns": self._last_ns if self._first_ns is None else self._first_ns,
            "outcome": self._outcome,
            "outages": self._outages,
        }


class _RecordingEnd(TypedDict):
    kind: Literal["End"]
    path: str
    stamp_ns: Stamp
    events: int
    missing: int
    first_ns: Stamp
    outcome: str | None
    outages: list[tuple[Stamp, Stamp]]


@dataclass(frozen=True, slots=True)
class Summary:
    """What a list shows of a recording, of which two lines are read if it has an end mark.

    Attributes:
        path: The file.
        machine: The machine's label.
        made_ns: When it was made [ns since the epoch].
        stamp_ns: The same by the mission's own time.
        run: Name of the run of a durable mission, or "".
        first_ns, last_ns: Stamps of its first and last event.
        outcome: Outcome of the newest run in it; None if that has not ended.
        outages: Pairs of stamps between which no process ran it.
        events: Number of events.
        missing: Number of events that were dropped.
        has_end: Whether it was completed.
        success: The machine's outcomes that are good; None goes by their names.
    """

    path: Path
    machine: str
    made_ns: int
    stamp_ns: int
    run: str
    first_ns: int
    last_ns: int
    outcome: str | None
    outages: tuple[tuple[int, int], ...]
    events: int
    missing: int
    has_end: bool
    success: tuple[str, ...] | None = None


def read_summary(path: str | Path) -> Summary:
    """Return the summary of a recording.

    Raises:
        RecordingError: it cannot be read.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            header = _read_header(
                path, file.readline(MAX_LINE_LENGTH + 1).decode("utf-8", "replace")
            )
            _, line = _last_line(file)
    except OSError as error:
        raise _unreadable(path, error) from error
    end: Any = None
    has_end = _is_end(line)
    if has_end:
        try:
            end = checked(
                _RecordingEnd, load_json(line.decode("utf-8", "replace"), longest=MAX_LINE_LENGTH)
            )
        except ValueError as error:
            raise RecordingError(path, f"got a wrong end mark ({error}).") from error
    else:
        facts, steady = _Facts(), SteadyStamps()
        for record in each_event(path):
            facts.add(steady.fix(record))
        end = facts.end()
    outages = tuple((first, last) for first, last in end["outages"])
    return Summary(
        path=path,
        machine=header.record.label,
        made_ns=header.made_ns,
        stamp_ns=header.stamp_ns,
        run=header.run,
        first_ns=end["first_ns"],
        last_ns=end["stamp_ns"],
        outcome=end["outcome"],
        outages=outages,
        events=end["events"],
        missing=end["missing"],
        has_end=has_end,
        success=header.record.success,
    )


def summaries(
    places: Iterable[str | Path], *, limit: int, skip: int = 0
) -> tuple[list[Summary], int]:
    """Return the summaries of the newest recordings in files and folders, the newest first.

    Files with parts of one durable run are one summary. A file in a folder that is not a recording
    is logged and skipped.

    Args:
        places: Files and folders.
        limit: The most files that are read.
        skip: Omit this many of the newest ones.

    Returns:
        The summaries, and how many files there are.

    Raises:
        RecordingError: there is no such file or folder, or a given file cannot be read.
    """
    given = {Path(place) for place in places}
    paths = sorted(find_recordings(places), key=_changed_ns, reverse=True)
    found: list[Summary] = []
    runs: dict[str, int] = {}  # name of a durable run -> its place in the list
    for path in paths[skip : skip + limit]:
        try:
            one = read_summary(path)
        except RecordingError as error:
            if path in given:
                raise
            log.logwarn(f"{error} It is left out.")
            continue
        at = runs.setdefault(one.run, len(found)) if one.run else len(found)
        if at < len(found):
            found[at] = _joined_summary(found[at], one)
        else:
            found.append(one)
    return found, len(paths)


def _joined_summary(one: Summary, other: Summary) -> Summary:
    """Join the summaries of two parts of a durable run; the last one has the most outages."""
    first, last = sorted((one, other), key=lambda part: (len(part.outages), part.made_ns))
    return replace(
        last,
        path=first.path,
        made_ns=first.made_ns,
        stamp_ns=first.stamp_ns,
        first_ns=first.first_ns,
        events=one.events + other.events,
        missing=one.missing + other.missing,
    )


def _changed_ns(path: Path) -> tuple[int, str]:
    try:
        return path.stat().st_mtime_ns, path.name
    except OSError:  # removed meanwhile: reading it says so
        return 0, path.name


def each_event(path: str | Path) -> Iterator[dict[str, Any]]:
    """Yield the events of a recording one after the other, as they are in the file.

    Raises:
        RecordingError: it cannot be read, or a line before the last is not an event.
    """
    return (record for _, record in _each(Path(path), "") if record["kind"] not in _NO_EVENTS)


def _each(path: Path, word: str) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield number and record of each whole line after the header that has `word` in it."""
    try:
        with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
            _read_header(path, file.readline(MAX_LINE_LENGTH + 1))
            for number, record in _records(path, file, lambda line: word in line):
                if record is not None:
                    yield number, record
    except OSError as error:
        raise _unreadable(path, error) from error


def _records(
    path: Path, file: TextIO, wanted: Callable[[str], bool] = bool
) -> Iterator[tuple[int, dict[str, Any] | None]]:
    """Yield the lines after the header: number and record; None for a last one that is cut off.

    Args:
        path: The file's path, for errors.
        file: The file, after the header.
        wanted: Whether a line is read; the others are passed over.
    """
    number = 1
    while line := file.readline(MAX_LINE_LENGTH + 1):
        number += 1
        if not line.endswith("\n") and len(line) <= MAX_LINE_LENGTH:
            yield number, None
            return
        if wanted(line):
            yield number, _read_line(path, number, line)


_NO_EVENTS = frozenset({OBSERVED, TYPES, END, CROSSED})
_TOPICS = f'{{"kind": "{OBSERVED}",'
_BLOCK = 65_536  # [bytes] read from the end of a file at once


def _last_line(file: BinaryIO) -> tuple[int, bytes]:
    """Return where the last complete line of a file begins, and the line."""
    begin, tail = file.seek(0, os.SEEK_END), b""
    # Two line ends: of the line before, and of the line itself.
    while begin and (tail.count(b"\n") < 2 and len(tail) <= MAX_LINE_LENGTH):  # noqa: PLR2004
        size = min(max(_BLOCK, len(tail)), begin)  # doubled: a long line is joined a few times
        begin = file.seek(begin - size)
        tail = file.read(size) + tail
    stop = tail.rfind(b"\n") + 1
    start = tail.rfind(b"\n", 0, max(0, stop - 1)) + 1
    return begin + start, tail[start:stop]


def has_end(path: Path) -> bool:
    """Return whether a recording was completed, by its last line."""
    try:
        with path.open("rb") as file:
            return _is_end(_last_line(file)[1])
    except OSError:
        return False


def _is_end(line: bytes) -> bool:
    """Return whether a line is an end mark; events of a machine have other kinds."""
    return line.startswith((b'{"kind":"End",', b'{"kind": "End",'))


def interface_texts(goal: str) -> dict[str, str]:
    """Return the definitions of an action's goal, result and feedback, with all types they use.

    Args:
        goal: The goal's type, "my_msgs/TurnGoal".

    Returns:
        Type -> text, as rosbag writes them. Empty for types of ROS, which are known everywhere, and
        if `goal` is not a goal type.
    """
    package = goal.partition("/")[0]
    if not goal.endswith("Goal") or (BUNDLED / package).is_dir():
        return {}
    names = [goal.removesuffix("Goal") + part for part in ("Goal", "Result", "Feedback")]
    try:
        return {name: get_message(name)._full_text for name in names}
    except ActionlibError:  # a type of ROS 2, or one that is gone
        return {}


def header_line(
    record: StateRecord,
    stamp_ns: int,
    base: dict[str, Any] | None = None,
    *,
    made_ns: int | None = None,
    run: str = "",
    origin: dict[str, Any] | None = None,
) -> str:
    """Return the first line of a file; `made_ns` is the real date if time is virtual."""
    header: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "stamp_ns": stamp_ns,
        "machine": asdict(record),
        "base": base,
        "made_ns": stamp_ns if made_ns is None else made_ns,
    }
    if run:
        header["run"] = run
    if origin is not None:
        header["origin"] = origin
    return json.dumps(header) + "\n"


def event_line(record: dict[str, Any]) -> str:
    """Return the line of an event."""
    return record_text(record) + "\n"


def recording_lines(
    record: StateRecord,
    events: Iterable[dict[str, Any]],
    base: dict[str, Any] | None,
    observed: Iterable[dict[str, Any]] = (),
    made_ns: int | None = None,
) -> Iterator[str]:
    """Yield the lines of a file with these events and records of the robot's topics.

    `made_ns` is the real date if time was virtual.
    """
    first = next(iter(events), {"stamp_ns": 0})
    stamp_ns = first["stamp_ns"]
    yield header_line(record, stamp_ns, base, made_ns=made_ns)
    by_time = heapq.merge(_numbered(events), observed, key=itemgetter("stamp_ns"))
    yield from map(event_line, by_time)


def _numbered(events: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield the events numbered from 1; missing events are counted, also those of lost lines."""
    seq = given = 0
    for event in events:
        before, given = given, event.get("seq", 0)
        dropped = max(event.get("dropped", 0), given - before - 1 if before else 0)
        seq += 1 + dropped
        yield {**event, "seq": seq, **({"dropped": dropped} if dropped else {})}


def read_recording(
    path: str | Path, *, stream: bool = False, newest: int | None = None, plots: bool = True
) -> Recording:
    """Read a file.

    Data of robots' topics, and inputs, that have another form than `smachpy.events.reading` knows
    are left out, with a warning.

    Args:
        path: The file.
        stream: Whether `events` and `observed` of a large file may be `Streamed`, for readers that
            only iterate them; inputs are left out then.
        newest: The most events that are kept, and the most records of topics besides maps; those
            before them are folded into `base`, and inputs are left out. None: all.
        plots: Whether what is only shown is read: data of robots' topics, and the content of
            feedback, which is None then.

    Raises:
        RecordingError: it cannot be read, or a line before the last is not an event; with the line.
            Streamed events raise it while they are iterated.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8", errors="replace", newline="\n") as file:
            size = os.fstat(file.fileno()).st_size
            if stream and size > STREAMED:
                header = _read_header(path, file.readline(MAX_LINE_LENGTH + 1))
                for _, record in _each(path, TYPES):
                    if record["kind"] == TYPES:
                        header.definitions.update(_texts(record.get("definitions")))
                events, observed = Streamed(path), Streamed(path, observed=True)
                return replace(header, events=events, observed=observed)  # type: ignore[arg-type]
            if size > LARGEST:
                raise RecordingError(path, f"got {size:,} bytes; expected at most {LARGEST:,}.")
            return _read(path, file, newest, plots)
    except OSError as error:
        raise _unreadable(path, error) from error


def _read(path: Path, file: TextIO, newest: int | None, plots: bool) -> Recording:
    recording = _read_header(path, file.readline(MAX_LINE_LENGTH + 1))
    wrong = recording.wrong

    def wanted(line: str) -> bool:
        return plots or not line.startswith(_TOPICS)

    def events() -> Iterator[dict[str, Any]]:
        for number, record in _records(path, file, wanted):
            if record is None:
                recording.cut = True
            elif record["kind"] in {OBSERVED, CROSSED}:
                if record["kind"] == OBSERVED and not plots:
                    continue
                try:
                    _add_data(recording, record, newest)
                except DataError as error:
                    wrong.append(f"line {number}: {error}")
            elif record["kind"] == TYPES:
                recording.definitions |= _texts(record.get("definitions"))
            elif record["kind"] != END:
                yield record

    found = events() if plots else map(_without_feedback, events())
    numbered = _numbered(map(SteadyStamps().fix, found))
    recording.events = list(numbered if newest is None else _newest(recording, numbered, newest))
    _tell_wrong(path, wrong)
    return recording


def _without_feedback(record: dict[str, Any]) -> dict[str, Any]:
    """Return an event without the content of feedback, which is most of a recording's memory."""
    return {**record, "feedback": None} if record["kind"] == "GoalFeedback" else record


def _tell_wrong(path: Path, wrong: Sequence[str]) -> None:
    if wrong:
        log.logwarn(
            f"recording {str(path)!r}: {len(wrong)} record(s) of topics or inputs are left out; "
            f"the first: {wrong[0]}"
        )


def _newest(
    recording: Recording, events: Iterable[dict[str, Any]], newest: int
) -> deque[dict[str, Any]]:
    """Return the newest events; fold the others into the recording's `base`."""
    kept: deque[dict[str, Any]] = deque()
    before = RunState(recording.base)
    for event in events:
        kept.append(event)
        if len(kept) > newest:
            before.fold(kept.popleft())
            recording.base = before.data
    return kept


def _add_data(recording: Recording, record: dict[str, Any], newest: int | None) -> None:
    """Add what is no event; raise `DataError` if it has a wrong form."""
    if record["kind"] == CROSSED:
        crossed = read_crossed(record)
        if newest is None:
            recording.inputs.append(crossed)
        return
    observed = recording.observed
    number = observed[-1]["n"] + 1 if observed else 1
    observed.append({**read_observed(record), "n": number})
    # Twice as many: they are gone through once in so many records.
    if newest is not None and len(observed) > 2 * newest:
        maps = (one for one in observed[:-newest] if one["what"] == "map")
        newest_maps = {one["robot"]: one for one in maps}
        observed[:-newest] = sorted(newest_maps.values(), key=itemgetter("n"))


def _texts(given: Any) -> dict[str, str]:
    return {str(k): str(v) for k, v in given.items()} if isinstance(given, dict) else {}


def _read_header(path: Path, line: str) -> Recording:
    data: Any = None
    try:
        data = load_json(line, longest=MAX_LINE_LENGTH, deepest=MAX_NESTING)
        _check_is_known(path, data)
        header = checked(_Header, data, known_only=True)
        record: StateRecord = checked(StateRecord, header["machine"])
        base = header.get("base")
        if base is not None:
            base = read_facts(base)
    except ValueError as error:
        is_ours = isinstance(data, dict) and data.get("format") == FORMAT
        got = f"{'a wrong' if is_ours else 'no'} header ({error})" if line else "an empty file"
        cut = ", which is cut off" if line and not line.endswith("\n") else ""
        raise RecordingError(
            path,
            f"line 1{cut}: got {got}; expected a file of `smachpy run --record`.",
        ) from error
    stamp_ns = header["stamp_ns"]
    made_ns = header.get("made_ns", stamp_ns)  # older files have none
    run, origin = header.get("run", ""), header.get("origin")
    return Recording(path, record, stamp_ns, base, made_ns=made_ns, run=run, origin=origin)


def _check_is_known(path: Path, data: Any) -> None:
    """Refuse a recording of a newer version, whatever else it has."""
    version = data.get("version") if isinstance(data, dict) else None
    if type(version) is int and version > VERSION and data.get("format") == FORMAT:
        raise RecordingError(
            path,
            f"line 1: got version {version}, of a newer smachpy; expected {VERSION}. Try to update "
            "smachpy.",
        )


class _Header(TypedDict):
    format: Literal["smachpy-run"]
    version: Literal[1]
    stamp_ns: Stamp
    machine: Any
    base: NotRequired[Any]
    made_ns: NotRequired[Stamp]
    run: NotRequired[str]
    origin: NotRequired[OriginFacts]


def run_of(path: Path) -> str:
    """Return the name of the durable run in a file; "" for other runs and other files."""
    try:
        with path.open("rb") as file:
            return _read_header(
                path, file.readline(MAX_LINE_LENGTH + 1).decode("utf-8", "replace")
            ).run
    except (OSError, RecordingError):
        return ""


def _read_line(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        return read_event(load_json(line, longest=MAX_LINE_LENGTH))
    except ValueError as error:
        raise RecordingError(
            path, f"line {number}: got {line[:60]!r} ({error}); expected an event."
        ) from error


def _unreadable(path: Path, error: OSError) -> RecordingError:
    if isinstance(error, IsADirectoryError):
        return RecordingError(path, "got a folder; expected one recorded run. Try a file in it.")
    return RecordingError(path, f"cannot read: {error.strerror or error}.")


def find_recordings(places: Iterable[str | Path]) -> list[Path]:
    """Return the given files, and the recordings in the given folders, sorted; each file once.

    Raises:
        RecordingError: there is no such file or folder.
    """
    found: dict[Path, Path] = {}
    for place in map(Path, places):
        if place.is_dir():
            some = sorted(place.glob("*.jsonl"))
        elif place.is_file():
            some = [place]
        else:
            got = "got a device or a pipe" if place.exists() else "no such file or folder"
            raise RecordingError(place, f"{got}; expected recorded runs.")
        for path in some:
            found.setdefault(_whole_path(path), path)
    return list(found.values())


def _whole_path(path: Path) -> Path:
    return path.parent.resolve() / path.name


def notes_file(recording: Path) -> Path:
    """Return the file with people's notes on a recording, beside it; it need not exist."""
    # Another dot is a part of the name: "run.1" and "run.2" are two recordings.
    return recording.with_name(f"{recording.name.removesuffix('.jsonl')}.notes.json")


def delete_recording(recording: Path) -> None:
    """Delete a recording, and the notes on it.

    Raises:
        OSError: they cannot be deleted.
    """
    recording.unlink(missing_ok=True)
    notes_file(recording).unlink(missing_ok=True)


class Streamed:
    """Records of a recording, read from the file each time they are iterated.

    Args:
        path: The file.
        observed: Whether they are those of the robot's topics; else they are the events.

    Raises:
        RecordingError: while they are iterated: a line is not a record; with the line.
    """

    def __init__(self, path: Path, *, observed: bool = False) -> None:
        self._path = path
        self._observed = observed

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the records, as `read_recording` returns them."""
        if self._observed:
            return self._each_observed()
        return _numbered(map(SteadyStamps().fix, each_event(self._path)))

    def _each_observed(self) -> Iterator[dict[str, Any]]:
        wrong: list[str] = []
        numbers = itertools.count(1)
        for line, record in _each(self._path, OBSERVED):
            if record["kind"] != OBSERVED:
                continue
            try:
                yield {**read_observed(record), "n": next(numbers)}
            except DataError as error:
                wrong.append(f"line {line}: {error}")
        _tell_wrong(self._path, wrong)


def each_recording(places: Iterable[str | Path], *, stream: bool = False) -> Iterator[Recording]:
    """Yield the recordings in the given files and folders, sorted.

    Each is read when it is needed. A file in a folder that is not a recording is logged and
    skipped. Files of a folder with parts of one durable run, written by several computers, are
    yielded as one recording with the path of the first part.

    Args:
        places: Files and folders.
        stream: As for `read_recording`.

    Raises:
        RecordingError: there is no such file or folder, or a given file cannot be read.
    """
    seen: set[Path] = set()
    for place in places:
        # Headers first: only files of the same durable run must be held in memory together.
        paths = [path for path in find_recordings([place]) if _whole_path(path) not in seen]
        seen.update(map(_whole_path, paths))
        runs = [run_of(path) for path in paths]
        parts: dict[str, list[Recording]] = {}
        for path, run in zip(paths, runs, strict=True):
            is_part = bool(run) and runs.count(run) > 1
            try:
                recording = read_recording(path, stream=stream and not is_part)
            except RecordingError as error:
                if not Path(place).is_dir():
                    raise
                log.logwarn(f"{error} It is left out.")
                continue
            if is_part:
                parts.setdefault(run, []).append(recording)
            else:
                yield recording
        yield from map(joined, parts.values())


def joined(parts: Sequence[Recording]) -> Recording:
    """Join the recordings of one durable run; the machine is that of the last one."""
    ordered = sorted(parts, key=_place)
    last = ordered[-1]
    observed = [one for part in ordered for one in part.observed]
    return replace(
        ordered[0],
        record=last.record,
        events=list(
            _numbered(map(SteadyStamps().fix, (e for part in ordered for e in part.events)))
        ),
        cut=last.cut,
        observed=[{**one, "n": number} for number, one in enumerate(observed, 1)],
        definitions={k: v for part in ordered for k, v in part.definitions.items()},
        inputs=[one for part in ordered for one in part.inputs],
    )


def _place(part: Recording) -> tuple[int, int]:
    """Sort parts by the number of outages before them; the computers' clocks may differ."""
    first = part.events[0] if part.events else {}
    return len(first.get("outages", ())), part.stamp_ns
