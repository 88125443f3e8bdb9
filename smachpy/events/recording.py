"""Recordings: one run in one file of JSON lines, appended during the run, readable after a crash.

The first line is the header: `format` "smachpy-run", `version`, `machine` (a
`smachpy.introspection.StateRecord`), `stamp_ns` and `base`, the `RunState` before the first event,
or null. A durable mission also has `run`, the name of its run: the process that resumes the mission
continues the file, or writes another file with the same `run`. Every further line is an event
(`smachpy.events.to_record`) with a number `seq`. Where events are missing, `seq` has a gap and the
next event has their number, `dropped`; the last visit of each state is never missing
(`events.buffer`). A last line that a crash has cut off is ignored when reading.

Lines of kind "Observed" are not events of the machine but data of the robot's topics
(`smachpy.network.observations`).
"""

from __future__ import annotations

import heapq
import json
from collections import deque
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from operator import itemgetter
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, get_type_hints

from actionlib_core.clock import RealClock, SerialExecutor, current_clock
from actionlib_core.exceptions import ActionlibError
from actionlib_core.interfaces import get_message
from actionlib_core.interfaces._sources import BUNDLED
from smachpy import log
from smachpy.events import EVENT_KINDS, record_text
from smachpy.exceptions import SmachError
from smachpy.introspection import StateRecord, describe

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Self, TextIO

    from smachpy.machines.container import Container

FORMAT = "smachpy-run"
VERSION = 1
OBSERVED = "Observed"
TYPES = "Types"
"""Kind of the records that hold definitions of the mission's own goal types."""
WAITING_OBSERVED = 1_000
"""Number of records of the robot's topics that wait to be written; then the oldest are dropped."""

WAITING_EVENTS = 100_000
"""Number of entries that wait to be written while the disk hangs, or while the machine is faster
than the writer. Further ones are thinned out and counted."""

CLOSE_S = 2.0  # time to write what waits [s]; a disk that hangs must not hang the program's end

_FIELDS = {"kind": str, "path": str, "stamp_ns": int}
_STAMPS = 2**63  # [ns] from 1970 on
_SECONDS = 2.0**33  # longest time on a mission's clock; `_STAMPS` in seconds
_MALFORMED = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)
"""Exceptions raised when reading JSON of an unexpected structure."""


class RecordingError(SmachError):
    """A recording cannot be written or read.

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
        observed: Records of the robot's topics, numbered from 1 in `n`.
        made_ns: When it was really made; `stamp_ns` differs if the mission's time was virtual.
        definitions: Texts of the mission's own message types, as `interface_texts` returns them.
        run: Name of the run of a durable mission, which may be in several files; else "".
    """

    path: Path
    record: StateRecord
    stamp_ns: int
    base: dict[str, Any] | None
    events: list[dict[str, Any]] = field(default_factory=list)
    cut: bool = False
    observed: list[dict[str, Any]] = field(default_factory=list)
    made_ns: int = 0
    definitions: dict[str, str] = field(default_factory=dict)
    run: str = ""

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


class Recorder:
    """Writes the events of a machine to a file; a context manager.

    Args:
        path: The file. It must not exist yet, unless it holds the durable run that `machine`
            resumes: then the rest of the run is appended.
        machine: The machine.
        run: Name of the durable run, `smachpy.durable.recorder.Recorder.run`; else "".

    Attributes:
        path: The file.
        earlier: The records that were already in the file.

    Raises:
        RecordingError: the file exists, cannot be made, or its content cannot be read.

    Threads: the machine never waits for the disk; another thread writes.
    """

    def __init__(self, path: str | Path, machine: Container, *, run: str = "") -> None:
        self.path = Path(path)
        self.earlier: list[dict[str, Any]] = []
        clock = current_clock()
        self._executor = SerialExecutor(clock, f"recording {self.path.name}")
        self._failed = self._closed = False
        self._unwritten = 0
        try:
            if run and run_of(self.path) == run:
                self._file = self._continued()
            else:
                # "x": an existing file is never overwritten, even if two processes begin at once.
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self.path.open("x", encoding="utf-8")
                made_ns = RealClock().time_ns()
                header = header_line(describe(machine), clock.time_ns(), made_ns=made_ns, run=run)
                self._file.write(header)
                self._file.flush()  # readable from now on, also if the process is killed
        except FileExistsError as error:
            raise RecordingError(
                path, "the file exists; expected a new name, runs are never overwritten."
            ) from error
        except OSError as error:
            raise RecordingError(path, f"cannot write: {error.strerror or error}.") from error
        self._observed: deque[dict[str, Any]] = deque(maxlen=WAITING_OBSERVED)
        self._types: set[str] = set()  # goal types whose definitions were looked up
        self._buffer = machine.event_buffer(self._on_news, limit=WAITING_EVENTS)

    def _continued(self) -> TextIO:
        """Open the file to append after its last complete line; the rest is removed."""
        self.earlier = read_recording(self.path).events
        with self.path.open("rb+") as file:
            kept = file.read().rfind(b"\n") + 1
            file.truncate(kept)
        return self.path.open("a", encoding="utf-8")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Write the waiting records and close the file; may be called twice.

        Blocks: 2 s at most.
        """
        # No new events from here on; the last ones are written by one more call of `_write`.
        self._closed = True
        self._buffer.close()
        self._on_news()
        in_time = self._executor.join(CLOSE_S)
        if in_time and self._file.closed:
            return
        if not in_time:
            log.logwarn(
                f"recording {str(self.path)!r}: still being written after {CLOSE_S:g} s; the end "
                "of the run is lost if the program ends now."
            )
        else:
            try:
                self._file.close()
            except OSError as error:
                self._fail(error)
        if self._buffer.dropped:
            log.logwarn(
                f"recording {str(self.path)!r}: {self._buffer.dropped} events are missing; more "
                "came than could be written. Every state's last visit is there."
            )
        if self._unwritten:
            log.logwarn(f"recording {str(self.path)!r}: {self._unwritten} events are not in it.")

    @property
    def dropped(self) -> int:
        """Number of events that were not written: too many at once, or the disk failed."""
        return self._buffer.dropped + self._unwritten

    def observe(self, record: dict[str, Any]) -> None:
        """Write a record of `RobotTopics`; does nothing after `close`."""
        if not self._closed:
            self._observed.append(record)
            self._on_news()

    def _on_news(self) -> None:
        self._executor.submit(self._write)

    def _write(self) -> None:
        """Write records until none are left."""
        while records := [*self._buffer.read(), *self._take_observed()]:
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

    def _take_observed(self) -> list[dict[str, Any]]:
        return [self._observed.popleft() for _ in range(len(self._observed))]

    def _fail(self, error: OSError) -> None:
        if not self._failed:
            self._failed = True
            log.logerr(f"recording {str(self.path)!r}: ends here: {error.strerror or error}.")


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
    return json.dumps(header) + "\n"


def event_line(record: dict[str, Any]) -> str:
    """Return the line of an event."""
    return record_text(record) + "\n"


def recording_lines(
    record: StateRecord,
    events: list[dict[str, Any]],
    base: dict[str, Any] | None,
    observed: Iterable[dict[str, Any]] = (),
) -> Iterator[str]:
    """Yield the lines of a file with these events and records of the robot's topics."""
    stamp_ns = events[0]["stamp_ns"] if events else 0
    yield header_line(record, stamp_ns, base)
    by_time = heapq.merge(_numbered(events), observed, key=itemgetter("stamp_ns"))
    yield from map(event_line, by_time)


def _numbered(events: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield the events numbered from 1; missing events are counted."""
    seq = 0
    for event in events:
        seq += 1 + event.get("dropped", 0)
        yield {**event, "seq": seq}


def read_recording(path: str | Path) -> Recording:
    """Read a file.

    Raises:
        RecordingError: it cannot be read, or a line before the last is not an event; with the line.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").split("\n")
    except OSError as error:
        raise RecordingError(path, f"cannot read: {error.strerror or error}.") from error
    recording = _read_header(path, lines[0])
    whole = lines[1:-1]  # the text after the last newline is empty, or was cut off
    recording.cut = bool(lines[-1]) and len(lines) > 1
    records = [_read_event(path, number, line) for number, line in enumerate(whole, 2)]
    recording.events = list(
        _numbered(one for one in records if one["kind"] not in {OBSERVED, TYPES})
    )
    for one in records:
        if one["kind"] == TYPES and isinstance(one.get("definitions"), dict):
            recording.definitions |= {str(k): str(v) for k, v in one["definitions"].items()}
    observed = (one for one in records if one["kind"] == OBSERVED)
    recording.observed = [{**one, "n": number} for number, one in enumerate(observed, 1)]
    return recording


def _read_header(path: Path, line: str) -> Recording:
    try:
        header = json.loads(line)
        if header["format"] != FORMAT or header["version"] != VERSION:
            raise ValueError(f"format {header['format']!r} version {header['version']!r}")
        record = StateRecord.from_json(json.dumps(header["machine"]))
        base = header.get("base")
        if base is not None:
            for name in ("states", "goals", "userdata"):
                for facts in base[name].values():
                    dict(facts)
        stamp_ns = _check_stamp(int(header["stamp_ns"]))
        made_ns = _check_stamp(int(header.get("made_ns", stamp_ns)))  # older files have none
        run = header.get("run", "")
        if not isinstance(run, str):
            raise TypeError(f"run: {run!r:.60}")
        return Recording(path, record, stamp_ns, base, made_ns=made_ns, run=run)
    except _MALFORMED as error:
        raise RecordingError(
            path, f"line 1: got no header ({error}); expected a file of `smachpy run --record`."
        ) from error


def run_of(path: Path) -> str:
    """Return the name of the durable run in a file; "" for other runs and other files."""
    try:
        with path.open("rb") as file:
            return _read_header(path, file.readline().decode("utf-8", "replace")).run
    except (OSError, RecordingError):
        return ""


def _check_stamp(stamp_ns: int) -> int:
    if not 0 <= stamp_ns < _STAMPS:
        raise ValueError(f"stamp_ns: {stamp_ns!r:.60}")
    return stamp_ns


def _read_event(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        # NaN and Infinity, which Python's JSON has and browsers refuse, become texts.
        event: dict[str, Any] = json.loads(line, parse_constant=str)
        for name, kind in _FIELDS.items():
            if type(event[name]) is not kind:
                raise ValueError(f"{name}: {event[name]!r}")
        _check_stamp(event["stamp_ns"])
        if event["kind"] in EVENT_KINDS:  # others are data of topics, or of a newer version
            event = _completed(event)
        dropped = event.get("dropped", 0)
        if type(dropped) is not int or dropped < 0:
            raise ValueError(f"dropped: {dropped!r}")
    except _MALFORMED as error:
        raise RecordingError(
            path, f"line {number}: got {line[:60]!r} ({error}); expected an event."
        ) from error
    return event


def _completed(event: dict[str, Any]) -> dict[str, Any]:
    """Check the fields of an event's kind; add the default of those that older files lack."""
    event = {**EVENT_KINDS[event["kind"]]._field_defaults, **event}
    for name, types in _field_types(event["kind"]).items():
        value = event[name]
        _check_type(name, value, types)
        if types is _LIST_OF_TEXTS:
            for item in value:
                _check_type(name, item, (str,))
    if not abs(event["t"]) < _SECONDS:
        raise ValueError(f"t: {event['t']!r}")
    if event["kind"] == "Recovered":
        _check_recovered(event)
    return event


_LIST_OF_TEXTS = (list, tuple, str)
_JSON_TYPES: dict[Any, tuple[type, ...]] = {
    str: (str,),
    str | None: (str, NoneType),
    int: (int,),
    bool: (bool,),
    # `to_record` writes infinities and lists that are too long as texts.
    float: (float, int, str),
    float | None: (float, int, str, NoneType),
    tuple[str, ...]: _LIST_OF_TEXTS,
}
"""Annotation of an event's field -> its types in a file; other fields take any value."""


@cache
def _field_types(kind: str) -> dict[str, tuple[type, ...]]:
    hints = get_type_hints(EVENT_KINDS[kind])
    types = {name: _JSON_TYPES.get(hint, ()) for name, hint in hints.items()}
    return {**types, "t": (float, int)}


def _check_type(name: str, value: Any, types: tuple[type, ...]) -> None:
    if types and type(value) not in types:
        raise TypeError(f"{name}: {value!r:.60}")


def _check_recovered(event: dict[str, Any]) -> None:
    _check_stamp(int(event["began_ns"]))
    for begin, end in event["outages"]:
        _check_stamp(int(begin))
        _check_stamp(int(end))
    for path, since in event["active"]:
        if not isinstance(path, str):
            raise TypeError(f"active: {path!r}")
        _check_stamp(int(since))


def find_recordings(places: Iterable[str | Path]) -> list[Path]:
    """Return the given files, and the recordings in the given folders, sorted.

    Raises:
        RecordingError: there is no such file or folder.
    """
    found: list[Path] = []
    for place in map(Path, places):
        if place.is_dir():
            found += sorted(place.glob("*.jsonl"))
        elif place.is_file():
            found.append(place)
        else:
            raise RecordingError(place, "no such file or folder; expected recorded runs.")
    return found


def each_recording(places: Iterable[str | Path]) -> Iterator[Recording]:
    """Yield the recordings in the given files and folders, sorted.

    Each is read when it is needed. A file in a folder that is not a recording is logged and
    skipped. Files of a folder with parts of one durable run, written by several computers, are
    yielded as one recording with the path of the first part.

    Raises:
        RecordingError: there is no such file or folder, or a given file cannot be read.
    """
    for place in places:
        # Headers first: only files of the same durable run must be held in memory together.
        paths = find_recordings([place])
        runs = [run_of(path) for path in paths]
        parts: dict[str, list[Recording]] = {}
        for path, run in zip(paths, runs, strict=True):
            try:
                recording = read_recording(path)
            except RecordingError as error:
                if not Path(place).is_dir():
                    raise
                log.logwarn(f"{error} It is left out.")
                continue
            if run and runs.count(run) > 1:
                parts.setdefault(run, []).append(recording)
            else:
                yield recording
        yield from map(joined, parts.values())


def joined(parts: Sequence[Recording]) -> Recording:
    """Join the recordings of one durable run; the machine is that of the last one."""
    ordered = sorted(parts, key=lambda part: part.stamp_ns)
    last = ordered[-1]
    observed = [one for part in ordered for one in part.observed]
    return replace(
        ordered[0],
        record=last.record,
        events=list(_numbered(event for part in ordered for event in part.events)),
        cut=last.cut,
        observed=[{**one, "n": number} for number, one in enumerate(observed, 1)],
        definitions={k: v for part in ordered for k, v in part.definitions.items()},
    )
