"""The events of a running machine: one closed union of small immutable records.

Every event begins with the same three fields: `path` of its state ("/PATROL/DRIVE"), `t`, the
clock's monotonic time [s], and `stamp_ns`, nanoseconds since the Unix epoch. Events are tuples,
because a transition takes less than a microsecond and making a dataclass takes more than that.

The events of one run, in order, rebuild it: `Started` and `Finished` enclose it; `Entered` and
`Left` enclose every state below the root, including containers. A state that raised has `Failed`
instead of `Left`. If another process resumes the run, its events begin with `Recovered`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from smachpy.userdata.secret import MASK as _MASK
from smachpy.userdata.secret import hides as _hides
from smachpy.userdata.shown import MAX_LIST_ITEMS, Room, short_text, shown

if TYPE_CHECKING:
    from collections.abc import Sequence


class Started(NamedTuple):
    """A root container began to run."""

    path: str
    t: float
    stamp_ns: int
    initial: tuple[str, ...] = ()


class Recovered(NamedTuple):
    """Another process resumes a durable run; takes the place of `Started`.

    The records of an event buffer have no second `Entered` for states that were active, so that the
    records of all processes, one after the other, form one run.

    Attributes:
        mission: Id of the mission.
        began_ns: When the run began [ns since the epoch].
        outages: Pairs (from, to) [ns since the epoch] in which no process ran it, the latest last.
        active: Pairs (path, since when [ns since the epoch]) of the states that were active.
    """

    path: str
    t: float
    stamp_ns: int
    mission: str
    began_ns: int
    outages: tuple[tuple[int, int], ...] = ()
    active: tuple[tuple[str, int], ...] = ()


class Finished(NamedTuple):
    """A root container's run ended; `outcome` is None if it raised."""

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
        trace: The innermost lines of the user's code in the traceback, "file:line in function:
            source", the last one raised; "" if there are none, and in older recordings.
    """

    path: str
    t: float
    stamp_ns: int
    error: str
    trace: str = ""


class PreemptRequested(NamedTuple):
    """The state was asked to stop.

    Below a container that was asked, every active state has its own event with the same `source`,
    `by` and `why`: those of the first cause.

    Attributes:
        source: The kind of origin: one of `SOURCES`.
        by: The signal's name, the operator's or client's name, the path of a state (a concurrence's
            child that ended, the state whose timeout passed, the state that asked), the action's
            name, or the thread's name; "" if nothing more is known.
        why: The reason in words ("ended with 'low'", "cancel of goal desk-1-3.5"), or "".
        grace: Time that the state has to stop [s] before it is interrupted; None for a container
            and for a state without a limit.
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
    """The state serviced its request: it called `service_preempt()`, or ended with 'preempted'.

    A state that was asked and has no such event is still running (and delays the preempt), has
    finished its work, or was interrupted. The event comes before the state's `Left`; in between the
    state cleans up.
    """

    path: str
    t: float
    stamp_ns: int


class Preempted(NamedTuple):
    """A container ended because of a preempt.

    Attributes:
        label: The child that was not started, or whose outcome was not followed; "" for none.
    """

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


class Noted(NamedTuple):
    """A state says in a few words what it is about (`State.note`)."""

    path: str
    t: float
    stamp_ns: int
    text: str


class ResourceUse(NamedTuple):
    """A state waits for a resource, holds it, is refused it, or holds it no longer.

    Attributes:
        resource: Its full name.
        status: "waits", "holds", "refused", or "free".
        holder: The state that holds it, if this one waits or is refused; else "".
    """

    path: str
    t: float
    stamp_ns: int
    resource: str
    status: str
    holder: str = ""


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
    """The machine is paused before the state at `path`; `reason`: "pause", "step", "breakpoint"."""

    path: str
    t: float
    stamp_ns: int
    reason: str


class Resumed(NamedTuple):
    """The machine continues with the state at `path`, or without it if that was called off."""

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
        marking: Ids of the places that hold tokens afterwards; a place with two tokens is in it
            twice.
    """

    path: str
    t: float
    stamp_ns: int
    transition: str
    marking: tuple[str, ...] = ()


class HeldBack(NamedTuple):
    """The plan at `path` waits: these transitions have their tokens, but their guards are false.

    Attributes:
        transitions: Ids.
        guards: Their guards, in the same order, as text.
        truths: The values of the names in each guard, in the same order: "low is true, there is
            false"; "" if they are not known.
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
        answers: The possible answers.
        words: The texts of their buttons, in the same order.
        default: The outcome if nobody answers.
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
    """A question was answered, or nobody answered it in time.

    Attributes:
        answer: The outcome.
        by: Who gave it; "" if nobody answered in time.
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
    | Noted
    | ResourceUse
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
"""Kinds of origins of a preempt (`PreemptRequested.source`) -> their names for people.

signal: a signal, including Ctrl-C. shutdown: `actionlib_core.shutdown` or the shutdown check.
operator: `machine.control`, here or over the network. timeout: that of the state or of a state
around it. concurrence: the end of a child. plan: the firing of a transition. action: a client's
cancel, a newer goal or the stop of the server, by `ActionServerWrapper`. state: code of a state or
callback. test: the test kit. program: anything else; `by` is the thread, or the argument of
`request_preempt(by=...)`.
"""

NUMBERS = frozenset({"seq", "dropped"})
"""Fields that a buffer adds to a record: its number, and how many events are missing before it."""

EVENT_KINDS = {kind.__name__: kind for kind in EVENT_TYPES}
"""`kind` of a record -> its class."""


def asker_text(source: str, by: str, why: str) -> str:
    """Return the origin of a preempt as one phrase for people ("timeout of /P/DRIVE: 5 s")."""
    who = f"{SOURCES.get(source, source)} {by}".strip()
    return f"{who}: {why}" if why else who


def resource_text(status: str, resource: str, holder: str) -> str:
    """Return, for people, what a state has of a resource: "waits for base, held by /P/DRIVE"."""
    words = {"waits": "waits for", "holds": "holds", "refused": "is refused"}.get(status, "frees")
    return f"{words} {resource}, held by {holder}" if holder else f"{words} {resource}"


def answered_text(answer: str, by: str) -> str:
    """Return the answer to a question as one phrase for people."""
    return f"answered {answer} by {by}" if by else f"nobody answered: {answer}"


def recovered_text(outages: Sequence[Sequence[int]]) -> str:
    """Return, as one phrase for people, that a run was resumed after the last of its outages."""
    seconds = (outages[-1][1] - outages[-1][0]) / 1e9 if outages else 0.0
    return f"resumed after an outage of {span_text(seconds)}"


def outages_text(outages: Sequence[Sequence[int]]) -> str:
    """Return the number of a mission's outages and their sum: "2, 3 min 20"; "" for none."""
    seconds = sum(end - begin for begin, end in outages) / 1e9
    return f"{len(outages)}, {span_text(seconds)}" if outages else ""


def span_text(seconds: float) -> str:
    """Return a duration for people: "3.2 s", "75 s", "3 min 20", "2 h 05"."""
    if seconds < 10:  # noqa: PLR2004
        return f"{seconds:.1f} s"
    whole = int(seconds)
    if whole < 120:  # noqa: PLR2004
        return f"{whole} s"
    minutes, rest = divmod(whole, 60)
    return f"{minutes} min {rest:02}" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02}"  # noqa: PLR2004


def to_record(event: Event) -> dict[str, Any]:
    """Return `event` as a dict of its fields and its `kind`, for JSON.

    Userdata, goals, feedback and results are in the form of `smachpy.userdata.shown`. Texts that
    are too long for display are cut; names are never cut.
    """
    # One `Room` for the whole record: many values of medium size are cut as one large value is.
    record: dict[str, Any] = {"kind": type(event).__name__}
    room = Room()
    for key, value in event._asdict().items():
        if key in _NAMES:
            record[key] = _listed(value)
        else:
            record[key] = shown(value, room) if key in _VALUES else _fact(value, room)
    if "value" in record and _hides(record.get("key"), event._asdict()["value"]):
        record["value"] = {"$repr": _MASK}
    return record


_NAMES = frozenset(
    {"path", "initial", "outcome", "label", "key", "action", "goal_id", "outages", "active"}
    | {"transition", "transitions", "marking"}
)
"""Fields that say what an event is about: if they were cut, they would name something else."""

_INFINITE = float("inf")

_VALUES = frozenset({"value", "goal", "feedback", "result"})
"""Fields with values of users."""


def _listed(value: Any) -> Any:
    return [_listed(item) for item in value] if isinstance(value, tuple) else value


def _tupled(value: Any) -> Any:
    return tuple(map(_tupled, value)) if isinstance(value, list) else value


def _fact(value: Any, room: Room) -> Any:
    """Return another field: a text or texts, a number, ..."""
    if isinstance(value, tuple | list):
        return [_fact(item, room) for item in value[:MAX_LIST_ITEMS]]
    if isinstance(value, str):
        return short_text(value, room)
    # A limit may be infinite, which JSON does not have.
    return str(value) if value in {_INFINITE, -_INFINITE} else value


def record_text(record: dict[str, Any]) -> str:
    """Return a record as JSON. Values that JSON refuses are replaced: no record is ever lost."""
    import json

    try:
        return json.dumps(record)
    except (TypeError, ValueError, RecursionError):
        return json.dumps({key: shown(value, Room()) for key, value in record.items()})


def from_record(record: dict[str, Any]) -> Event:
    """Rebuild the event of a `to_record` dict; the fields that a buffer has added are ignored.

    Raises:
        ValueError: `kind` is not the name of an event, or a field is missing or unknown.
    """
    fields = {key: v for key, v in record.items() if key not in NUMBERS}
    name = fields.pop("kind", None)
    kind = EVENT_KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise ValueError(
            f"event record: kind: got {name!r}; expected one of {sorted(EVENT_KINDS)}."
        )
    # JSON has lists where events have tuples; those in values are of users.
    fields = {key: v if key in _VALUES else _tupled(v) for key, v in fields.items()}
    try:
        return kind(**fields)
    except TypeError as error:
        raise ValueError(
            f"event record: {name}: got fields {sorted(fields)}; expected {list(kind._fields)}."
        ) from error
