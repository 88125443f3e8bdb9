"""What a running machine reports: one closed union of small immutable records.

Every event begins with the same three fields: `path` of the state it is about
("/PATROL/DRIVE"), `t`, the clock's monotonic time [s], and `stamp_ns`, nanoseconds since the
Unix epoch. Events are tuples, because a transition costs less than a microsecond and making a
dataclass costs more than that.

The events of one run, in order, rebuild it: `Started` and `Finished` enclose it; `Entered` and
`Left` enclose every state below the root, containers included. A state that raised has `Failed`
in place of `Left`. When another process goes on with a run, its events begin with `Recovered`.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from smachpy.userdata.shown import (
    DEEPEST,
    LONGEST_LIST,
    LONGEST_TEXT,
    MOST_TEXT,
    WIDEST_INT,
    Room,
    text_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence


class Started(NamedTuple):
    """A root container began to run."""

    path: str
    t: float
    stamp_ns: int
    initial: tuple[str, ...] = ()


class Recovered(NamedTuple):
    """Another process goes on with a durable run; in place of `Started`.

    What was under way goes on: records of a buffer have no `Entered` for it, so that those of all
    processes, one after the other, are one run.

    Attributes:
        mission: Id of the mission.
        began_ns: When the run began [ns since the epoch].
        outages: Pairs (from, to) [ns since the epoch] in which no process ran it, this one last.
        active: Pairs (path, since when [ns since the epoch]) of the states that go on.
    """

    path: str
    t: float
    stamp_ns: int
    mission: str
    began_ns: int
    outages: tuple[tuple[int, int], ...] = ()
    active: tuple[tuple[str, int], ...] = ()


class Finished(NamedTuple):
    """A root container's run ended; `outcome` is None when it raised."""

    path: str
    t: float
    stamp_ns: int
    outcome: str | None


class Entered(NamedTuple):
    """A state became active."""

    path: str
    t: float
    stamp_ns: int


class Left(NamedTuple):
    """A state ended with `outcome`."""

    path: str
    t: float
    stamp_ns: int
    outcome: str


class Failed(NamedTuple):
    """A state raised.

    Attributes:
        error: "Type: message".
        trace: Where: the innermost lines of the user's code, "file:line in function: source", the
            last one raised; "" where no code of theirs is involved, and in older recordings.
    """

    path: str
    t: float
    stamp_ns: int
    error: str
    trace: str = ""


class PreemptRequested(NamedTuple):
    """Somebody asked the state to stop.

    Below a container that was asked, every active state has such an event of its own, with the
    same `source`, `by` and `why`: they tell where the wish came from first.

    Attributes:
        source: Kind of its origin: one of `SOURCES`.
        by: Who: the signal's name, the operator's or client's name, the path of the state (of a
            concurrence's child that ended, of the state whose timeout passed, of the state that
            asked), the action's name, the thread's name; "" when there is no more to say.
        why: What happened, in words ("ended with 'low'", "cancel of goal desk-1-3.5"), or "".
        grace: Time that the state has to stop [s] before it is abandoned; None for a container and
            for a state without a limit.
    """

    path: str
    t: float
    stamp_ns: int
    source: str = "program"
    by: str = ""
    why: str = ""
    grace: float | None = None

    @property
    def asker(self) -> str:
        """Who asked and why, in one phrase for people."""
        return asker_text(self.source, self.by, self.why)


class PreemptServiced(NamedTuple):
    """The state acknowledged its preempt: `service_preempt()`, or it ended with 'preempted'.

    A state that was asked and has no such event still runs (and delays the preempt), has finished
    its work, or was abandoned. The event comes before the state's `Left`; in between the state
    cleans up.
    """

    path: str
    t: float
    stamp_ns: int


class Preempted(NamedTuple):
    """A container ended because of a preempt; `label`: the child not started or not followed."""

    path: str
    t: float
    stamp_ns: int
    label: str


class Abandoned(NamedTuple):
    """A state ignored its preempt for `grace` [s]; `stack` shows where it was."""

    path: str
    t: float
    stamp_ns: int
    grace: float
    stack: str


class TimedOut(NamedTuple):
    """A state ran into its `timeout` [s] and was preempted."""

    path: str
    t: float
    stamp_ns: int
    timeout: float


class Retried(NamedTuple):
    """A state runs again after attempt number `attempt` ended with `reason`."""

    path: str
    t: float
    stamp_ns: int
    attempt: int
    reason: str


class Iterated(NamedTuple):
    """An iterator took item `number` (from 0)."""

    path: str
    t: float
    stamp_ns: int
    number: int


class CallbackFailed(NamedTuple):
    """A callback, hook or listener raised; the machine goes on."""

    path: str
    t: float
    stamp_ns: int
    callback: str
    error: str


class UserdataWritten(NamedTuple):
    """The state at `path` wrote `value` to `key` (the container's name of the key)."""

    path: str
    t: float
    stamp_ns: int
    key: str
    value: Any


class Paused(NamedTuple):
    """The machine stands still before `path`; `reason`: "pause", "step" or "breakpoint"."""

    path: str
    t: float
    stamp_ns: int
    reason: str


class Resumed(NamedTuple):
    """The machine goes on with the state at `path`, or without it if it was called off."""

    path: str
    t: float
    stamp_ns: int


class Jumped(NamedTuple):
    """An operator sent the container at `path` to its child `label`."""

    path: str
    t: float
    stamp_ns: int
    label: str


class OutcomeForced(NamedTuple):
    """An operator ended the state at `path` with `outcome`."""

    path: str
    t: float
    stamp_ns: int
    outcome: str


class Fired(NamedTuple):
    """A transition of the plan at `path` fired.

    Attributes:
        transition: Its id.
        marking: Ids of the places that hold tokens afterwards, a place with two tokens twice.
    """

    path: str
    t: float
    stamp_ns: int
    transition: str
    marking: tuple[str, ...] = ()


class HeldBack(NamedTuple):
    """The plan at `path` waits: these transitions have their tokens, and their guards are false.

    Attributes:
        transitions: Ids.
        guards: Their guards, in the same order, as text.
        truths: What the names in each guard are worth, in the same order: "low is true, there is
            false"; "" when that is not known.
    """

    path: str
    t: float
    stamp_ns: int
    transitions: tuple[str, ...]
    guards: tuple[str, ...]
    truths: tuple[str, ...] = ()


class QuestionAsked(NamedTuple):
    """A state asks a person.

    Attributes:
        text: The question.
        answers: What may be answered.
        words: What to write on their buttons, in the same order.
        default: The outcome when nobody answers.
        patience: Time for an answer [s].
        service: Full name of the service that takes the answer (`smachpy.states.questions`).
        has_picture: The service has a picture to show.
    """

    path: str
    t: float
    stamp_ns: int
    text: str
    answers: tuple[str, ...]
    words: tuple[str, ...]
    default: str
    patience: float
    service: str = ""
    has_picture: bool = False


class QuestionAnswered(NamedTuple):
    """A question has its answer.

    Attributes:
        answer: The outcome.
        by: Who gave it; "": nobody did in time.
    """

    path: str
    t: float
    stamp_ns: int
    answer: str
    by: str


class GoalSent(NamedTuple):
    """An action state sent a goal."""

    path: str
    t: float
    stamp_ns: int
    action: str
    goal_id: str
    goal: Any


class GoalFeedback(NamedTuple):
    """An action server reported progress."""

    path: str
    t: float
    stamp_ns: int
    action: str
    goal_id: str
    feedback: Any


class GoalDone(NamedTuple):
    """A goal ended; `status` is the name of its goal status ("SUCCEEDED")."""

    path: str
    t: float
    stamp_ns: int
    action: str
    goal_id: str
    status: str
    text: str
    result: Any = None


Event: TypeAlias = (
    Started
    | Recovered
    | Finished
    | Entered
    | Left
    | Failed
    | PreemptRequested
    | PreemptServiced
    | Preempted
    | Abandoned
    | TimedOut
    | Retried
    | Iterated
    | CallbackFailed
    | UserdataWritten
    | Paused
    | Resumed
    | Jumped
    | OutcomeForced
    | Fired
    | HeldBack
    | QuestionAsked
    | QuestionAnswered
    | GoalSent
    | GoalFeedback
    | GoalDone
)

EVENT_TYPES: tuple[type[Event], ...] = Event.__args__

SOURCES: dict[str, str] = {
    "signal": "signal",
    "shutdown": "the program's end",
    "operator": "operator",
    "timeout": "timeout of",
    "concurrence": "concurrence, after",
    "plan": "plan",
    "action": "action",
    "state": "state",
    "test": "test",
    "program": "program",
}
"""Kinds of origins of a preempt (`PreemptRequested.source`) -> what to call them.

signal: a signal, Ctrl-C too. shutdown: `actionlib_core.shutdown` or the shutdown check. operator:
`machine.control`, here or over the network. timeout: the state's, or that of a state around it.
concurrence: the end of a child. plan: the firing of a transition.
action: a client's cancel, a newer goal or the server's stop, by
`ActionServerWrapper`. state: code that a state or callback ran. test: the test kit. program: all
else; `by` is the thread, or what `request_preempt(by=...)` said.
"""

NUMBERS = frozenset({"seq", "dropped"})
"""What a buffer adds to a record: the event's number, and how many events are missing before it."""

_BY_NAME = {kind.__name__: kind for kind in EVENT_TYPES}


def asker_text(source: str, by: str, why: str) -> str:
    """Return who asked for a preempt, in one phrase for people ("timeout of /P/DRIVE: 5 s")."""
    who = f"{SOURCES.get(source, source)} {by}".strip()
    return f"{who}: {why}" if why else who


def answered_text(answer: str, by: str) -> str:
    """Return how a question was answered, in one phrase for people."""
    return f"answered {answer} by {by}" if by else f"nobody answered: {answer}"


def recovered_text(outages: Sequence[Sequence[int]]) -> str:
    """Return that a run goes on after the last of its outages, in one phrase for people."""
    seconds = (outages[-1][1] - outages[-1][0]) / 1e9 if outages else 0.0
    return f"goes on after an outage of {span_text(seconds)}"


def outages_text(outages: Sequence[Sequence[int]]) -> str:
    """Return how often and how long no process ran a mission: "2, 3 min 20"; "" for never."""
    seconds = sum(end - begin for begin, end in outages) / 1e9
    return f"{len(outages)}, {span_text(seconds)}" if outages else ""


def span_text(seconds: float) -> str:
    """Return a span of time as people say it: "3.2 s", "75 s", "3 min 20", "2 h 05"."""
    if seconds < 10:  # noqa: PLR2004
        return f"{seconds:.1f} s"
    whole = int(seconds)
    if whole < 120:  # noqa: PLR2004
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} min {rest:02}" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02}"  # noqa: PLR2004


def to_record(event: Event) -> dict[str, Any]:
    """Return `event` as a dict of its fields and its `kind`, for JSON.

    Messages become `{"$msg": type, "fields": {...}}`; other values that JSON does not know are
    replaced by their `repr`, and those that are too long to look at are cut or named by their size.
    """
    record: dict[str, Any] = {"kind": type(event).__name__}
    room = Room()
    for key, value in event._asdict().items():
        record[key] = _plain(value, room)
    return record


def record_text(record: dict[str, Any]) -> str:
    """Return a record as JSON; what JSON does not take is replaced, the record is never lost."""
    try:
        return json.dumps(record)
    except (TypeError, ValueError, RecursionError):
        return json.dumps({key: _plain(value, Room()) for key, value in record.items()})


def was_cut(text: str, size: int) -> bool:
    """Return whether a text in a record may be the beginning of a longer one.

    Args:
        text: As it is in the record.
        size: Characters that the whole record has as JSON; texts of a long one are cut shorter.
    """
    return text.endswith("\u2026") and (len(text) > LONGEST_TEXT or size >= MOST_TEXT)


def from_record(record: dict[str, Any]) -> Event:
    """Rebuild the event of a `to_record` dict; the numbers of a buffer in it are passed over.

    Raises:
        ValueError: `kind` names no event, or a field is missing or unknown.
    """
    fields = {key: v for key, v in record.items() if key not in NUMBERS}
    name = fields.pop("kind", None)
    kind = _BY_NAME.get(name) if isinstance(name, str) else None
    if kind is None:
        raise ValueError(f"event record: kind: got {name!r}; expected one of {sorted(_BY_NAME)}.")
    fields = {key: tuple(v) if isinstance(v, list) else v for key, v in fields.items()}
    try:
        return kind(**fields)
    except TypeError as error:
        raise ValueError(
            f"event record: {name}: got fields {sorted(fields)}; expected {list(kind._fields)}."
        ) from error


def _plain(value: Any, room: Room, depth: int = 0) -> Any:
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        bits = value.bit_length()
        return value if bits <= WIDEST_INT else f"<int of {bits} bits>"
    if isinstance(value, float) and math.isfinite(value):
        return value
    if isinstance(value, str):
        return _cut(value, room)
    try:
        shown = _container(value, room, depth) if depth < DEEPEST else None
    except Exception as error:  # noqa: BLE001  foreign code: its failure is what there is to show
        return f"<{type(value).__name__}: looking at it raised {type(error).__name__}>"
    return _cut(text_of(value, room), room) if shown is None else shown


def _cut(text: str, room: Room) -> str:
    most = min(LONGEST_TEXT, max(room.text, 0))
    room.text -= min(len(text), most)
    return text if len(text) <= most else text[:most] + "\u2026"


def _container(value: Any, room: Room, depth: int) -> Any:
    """What is inside, None when it is no container or too long."""
    if isinstance(value, (list, tuple, dict)):
        if len(value) > min(LONGEST_LIST, room.items):
            return None
        room.items -= len(value)
        if not isinstance(value, dict):
            return [_plain(item, room, depth + 1) for item in value]
        pairs = list(value.items())
        if all(isinstance(key, str) for key, _ in pairs):
            room.text -= sum(len(key) for key, _ in pairs)
            return {key[:LONGEST_TEXT]: _plain(item, room, depth + 1) for key, item in pairs}
        return None
    return _fields_of(value, room, depth)


def _fields_of(value: Any, room: Room, depth: int) -> Any:
    """A message, or a ROS time or duration, by its fields; None when it is none."""
    if hasattr(value, "_md5sum") and hasattr(value, "__slots__"):
        fields = {name: getattr(value, name, None) for name in value.__slots__}
        return {"$msg": str(value._type), "fields": _plain(fields, room, depth + 1)}
    if hasattr(value, "to_nsec") and hasattr(value, "nsecs"):
        parts = {"secs": value.secs, "nsecs": value.nsecs}
        return {name: _plain(part, room, depth + 1) for name, part in parts.items()}
    return None
