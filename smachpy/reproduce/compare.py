"""Compares a run with its recording, and finds the first difference; pure.

Branches that run side by side have no order between them that a mission could rely on: each is
compared for itself, and the difference that came first counts.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_left, insort
from collections import defaultdict
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.inputs.suggest import did_you_mean
from smachpy.command.evidence import NOTE
from smachpy.userdata.shown import literal

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from smachpy.events.introspection import StateRecord

FIELDS: Final[dict[str, tuple[str, ...]]] = {
    "Started": (),
    "Finished": ("outcome",),
    "Entered": (),
    "Left": ("outcome",),
    "Failed": ("error",),
    "PreemptRequested": ("source",),
    "Preempted": ("label",),
    "Abandoned": (),
    "TimedOut": ("timeout",),
    "Retried": ("attempt", "reason"),
    "Iterated": ("number",),
    "Noted": ("text",),
    "CallbackFailed": ("callback", "error"),
    "UserdataWritten": ("key", "value"),
    "Jumped": ("label",),
    "OutcomeForced": ("outcome",),
    "Fired": ("transition", "marking"),
    "QuestionAsked": ("text", "answers"),
    "QuestionAnswered": ("answer",),
    "GoalSent": ("action", "goal"),
    "GoalDone": ("action", "status", "result", "cancelled"),
}
"""Kinds of events that are compared, and the fields that must be equal."""

GROUPS: Final[dict[str, tuple[str, ...]]] = {
    "userdata": ("UserdataWritten",),
    "goals": ("GoalSent", "GoalDone"),
    "errors": ("CallbackFailed",),
}
"""What `--tolerate` can name besides keys of userdata and states."""

GOES_ON_S: Final = 0.5
"""A state that ends later than recorded by more than this goes on [s]."""

_BY_LIMIT: Final = 0.5
"""A limit counts if the time has changed by so much of the limit's change."""

_REMAPPED_S: Final = 0.6
"""A state that reads other keys may take another time: it counts from half of this [s]."""

_SLEEPS_S: Final = 1.0
"""A state of code that has changed differs if it takes longer than recorded by more than this [s].

One that takes less does not: on the robot the code took time itself, and here it takes none.
"""

_NEAR_S: Final = 600.0
"""A value is a moment of the clock if it is nearer to now than this [s]."""

_SHORT: Final = 60
"""Of longer values that differ, only the parts that differ are shown [characters]."""

_ENDS: Final = frozenset({"Left", "Retried", "QuestionAnswered"})
_LIMIT: Final = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_PARALLEL: Final = frozenset({"concurrence", "plan"})
_STAMPS: Final = frozenset({"stamp", "seq"})  # of headers: they are of the time, not of the run


@dataclass(frozen=True, slots=True)
class Step:
    """An event that is compared.

    Attributes:
        number: Its number among all that are compared, from 1.
        at: When [s after the begin of the run].
        kind, path: Of the event.
        facts: The fields that are compared.
        lane: The branch in which it happened, "" for the trunk.
        took: How long the attempt took that it ends [s].
        index: Number among all events of its run, from 0.
        t: When, by the mission's clock [s].
    """

    number: int
    at: float
    kind: str
    path: str
    facts: tuple[tuple[str, Any], ...]
    lane: str
    took: float = 0.0
    index: int = 0
    t: float = 0.0

    def is_same(self, other: Step) -> bool:
        """Whether two steps are the same; so are moments of two clocks that are as far away."""
        if self.sameness == other.sameness:
            return True
        then, now = dict(self.facts).get("value"), dict(other.facts).get("value")
        if self.kind != "UserdataWritten" or not (
            isinstance(then, float) and isinstance(now, float)
        ):
            return False
        here, there = then - self.t, now - other.t
        is_time = max(abs(here), abs(there)) < _NEAR_S and abs(self.t - other.t) > 2 * _NEAR_S
        same_facts = {**dict(self.facts), "value": now} == dict(other.facts)
        return is_time and self.path == other.path and same_facts and abs(here - there) < 1.0

    @property
    def sameness(self) -> Any:
        """Equal for equal steps."""
        return self.kind, self.path, self.facts

    def words(self, after: str = "") -> str:
        """Return the step in words for people, `after` which time."""
        facts = defaultdict(  # `_apart` leaves out what is the same
            lambda: "the same",
            {
                key: literal(value) if not isinstance(value, str) else value
                for key, value in self.facts
            },
        )
        where = place(self.path)
        said = _SAID.get(self.kind, self.kind)
        try:
            return f"{where}  {said.format_map(facts)}{after}"
        except ValueError:
            return f"{where}  {self.kind} {dict(facts)}"


_SAID: Final = {
    "Started": "begins",
    "Finished": "ends: {outcome}",
    "Entered": "begins",
    "Left": "{outcome}",
    "Failed": "raises {error}",
    "PreemptRequested": "is asked to stop ({source})",
    "Preempted": "is preempted",
    "Abandoned": "does not stop, and is left behind",
    "TimedOut": "runs into its timeout of {timeout} s",
    "Retried": "is tried again after attempt {attempt}: {reason}",
    "Iterated": "takes item {number}",
    "Noted": "notes {text!r}",
    "CallbackFailed": "{callback} raises {error}",
    "UserdataWritten": "writes {key} = {value}",
    "Jumped": "jumps to {label}",
    "OutcomeForced": "is ended with {outcome}",
    "Fired": "fires {transition}",
    "QuestionAsked": "asks {text!r}",
    "QuestionAnswered": "gets the answer {answer}",
    "GoalSent": "sends {action} {goal}",
    "GoalDone": "{action} is {status}, result {result}, cancelled: {cancelled}",
}


@dataclass(frozen=True, slots=True)
class Said:
    """What a condition says of a message; see `actionlib_core.border.Verdicts`."""

    t: float
    path: str
    topic: str
    value: Any
    state: str
    after: int


@dataclass(frozen=True, slots=True)
class Odd:
    """Something that differs and is no event of the run.

    Attributes:
        at: When [s after the begin].
        path: Path of the state, or of the machine.
        recorded, now: What happened then and now, in words.
        after: Number of events of the run before it.
    """

    at: float
    path: str
    recorded: str
    now: str
    after: int


@dataclass(frozen=True, slots=True)
class Difference:
    """The first difference.

    Attributes:
        number: Number of the recorded event, or of the run's own if the recording has none there.
        at: When [s after the begin].
        path: Path of the state.
        before: The last steps that are the same, in words.
        recorded, now: What happened then and now, in words.
        recorded_next, now_next: What came after that.
        later: How much later this run was than the recorded one at the last step that was the same
            there [s]; negative if it was earlier.
    """

    number: int
    at: float
    path: str
    before: tuple[str, ...]
    recorded: str
    now: str
    recorded_next: tuple[str, ...] = ()
    now_next: tuple[str, ...] = ()
    later: float = 0.0


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a run compares with its recording.

    Attributes:
        same: Number of recorded events before the first difference; all without one.
        total: Number of recorded events that are compared.
        difference: The first one; None if there is none.
    """

    same: int
    total: int
    difference: Difference | None = field(default=None)


def steps_of(
    events: Iterable[Mapping[str, Any]],
    record: StateRecord,
    cancelled: Collection[str],
    tolerate: Collection[str] = (),
) -> list[Step]:
    """Return the steps of a run that are compared.

    Args:
        events: Its records.
        record: The machine.
        cancelled: Ids of the goals that were cancelled.
        tolerate: What may differ: "userdata", "goals", "errors", a key of userdata, or a state by
            its path or the end of it, with all in it.
    """
    parallel = [state.path for state in record.walk() if state.kind in _PARALLEL]
    actions = {state.path for state in record.walk() if state.kind == "action"}
    left_out = {kind for name in tolerate for kind in GROUPS.get(name, ())}
    found: list[Step] = []
    began: float | None = None
    begins: dict[str, float] = {}  # of the present attempts of states
    for index, event in enumerate(events):
        kind, path, t = event["kind"], event["path"], event.get("t", 0.0)
        began = t if began is None else began
        took = t - begins.get(path, t)
        if kind in {"Entered", "Retried"}:
            begins[path] = t
        names = FIELDS.get(kind)
        if names is None or kind in left_out or is_tolerated(event, tolerate):
            continue
        if kind == "UserdataWritten" and _is_progress(event.get("value")):
            continue  # it is shown to people, and tells of times
        if kind == "Noted" and path == record.path and str(event.get("text")).startswith(NOTE):
            continue  # of the evidence that there was, and not of the run
        facts = {name: _plain(event.get(name)) for name in names}
        if "error" in facts:  # further lines list threads and places
            facts["error"] = str(facts["error"]).partition("\n")[0]
        if "cancelled" in facts:
            facts["cancelled"] = event.get("goal_id") in cancelled
        number = len(found) + 1
        # A machine that serves the goal of a state of this one runs beside that.
        served = next((f"{above}/" for above in _above(path) if above in actions), "")
        lane, at = served or _lane(path, parallel), t - began
        found.append(Step(number, at, kind, path, tuple(facts.items()), lane, took, index, t))
    return found


def unknown_tolerated(
    tolerate: Iterable[str], records: Iterable[StateRecord], events: Iterable[Mapping[str, Any]]
) -> list[str]:
    """Return problems: the names of `tolerate` that nothing in the machines and events has."""
    states = [state for record in records for state in record.walk()]
    keys = {key for state in states for key in (*state.input_keys, *state.output_keys)}
    keys.update(event["key"] for event in events if "key" in event)
    known = sorted({*GROUPS, *keys, *(state.label for state in states)})
    return [
        f"tolerate: no state and no key is called {name!r}.{did_you_mean(name, known)}"
        for name in tolerate
        if name.strip("/") not in {*GROUPS, *keys}
        and not any(f"{state.path}/".endswith(f"/{name.strip('/')}/") for state in states)
    ]


def is_tolerated(event: Mapping[str, Any], tolerate: Collection[str]) -> bool:
    """Whether a name of `tolerate` leaves out an event."""
    path = event["path"]
    for name in tolerate:
        word = name.strip("/")
        if event.get("key") == word or f"{path}/".endswith(f"/{word}/") or f"/{word}/" in path:
            return True
    return False


def _is_progress(value: Any) -> bool:
    return isinstance(value, dict) and value.get("$object") == "Progress"


def limit_changes(old: StateRecord, new: StateRecord) -> dict[str, list[float]]:
    """Return by how much the numbers in the details of states have changed: path -> changes.

    These are limits: timeouts, waits, pauses before another attempt. A state with another
    remapping may have another limit, too.
    """
    before = {state.path: state for state in old.walk()}
    found: dict[str, list[float]] = {}
    for state in new.walk():
        then = before.get(state.path)
        if then is None:
            continue
        if then.remapping != state.remapping:
            found[state.path] = [_REMAPPED_S, -_REMAPPED_S]
        details = dict(then.details)
        for key, text in state.details:
            was, is_ = (_LIMIT.findall(one) for one in (details.get(key, ""), text))
            changed = [float(b) - float(a) for a, b in zip(was, is_, strict=False) if a != b]
            if changed:
                found.setdefault(state.path, []).extend(changed)
    return found


def own_states(record: StateRecord) -> set[str]:
    """Return the paths of the states that only run the program's own code."""
    return {state.path for state in record.walk() if state.kind in {"state", "callback"}}


def _sleeps_longer(then: Step, now: Step, changed: Collection[str]) -> bool:
    """Whether a state of which the code has changed took longer to come to its outcome."""
    ended = then.kind == "Left" and dict(then.facts)["outcome"] != "preempted"
    return ended and then.path in changed and now.took - then.took > _SLEEPS_S


def _follows(then: Step, now: Step, limits: Mapping[str, Collection[float]]) -> bool:
    """Whether a state took longer or shorter as a limit of it has become."""
    later = now.took - then.took
    changes = limits.get(then.path, ()) if then.kind in _ENDS else ()
    return any(later / change > _BY_LIMIT for change in changes)


def _plain(value: Any) -> Any:
    """Return a value without the stamps of headers."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items() if key not in _STAMPS}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _above(path: str) -> Iterator[str]:
    while path := path.rpartition("/")[0]:
        yield path


def _lane(path: str, parallel: Iterable[str]) -> str:
    above = max((one for one in parallel if path.startswith(f"{one}/")), key=len, default="")
    return f"{above}/{path.removeprefix(above).split('/')[1]}" if above else ""


def odd_verdicts(
    inputs: Iterable[Mapping[str, Any]], said: Iterable[Said], began: float
) -> Iterator[Odd]:
    """Yield the messages of which a condition says something else than in the recording.

    Args:
        inputs: What is recorded.
        said: What is said now.
        began: When this run began [s].
    """
    known: defaultdict[str, dict[str, set[str]]] = defaultdict(dict)
    now = list(said)
    if not now:
        return
    paths = {one.path for one in now}
    before: dict[str, Mapping[str, Any]] = {}
    messages: defaultdict[str, list[Mapping[str, Any]]] = defaultdict(list)  # by topic and time
    for one in inputs:
        if one["what"] == "message":
            insort(messages[f"/{one['name']}"], one, key=_time)
        elif one["what"] == "said" and one["name"] in paths:
            path, last = one["name"], before.get(one["name"])
            if last is not None:  # it said the same of the messages between the two
                for message in _between(messages, one["key"], last["t"], one["t"]):
                    if message.get("value") != one.get("value"):
                        _add(known[path], message, last["state"])
            _add(known[path], one, one["state"])
            before[path] = one
    for one_ in now:
        then = known[one_.path].get(_text_of(one_.value), set())
        if then and one_.state not in then:
            shown = f"to {one_.topic} {literal(_plain(one_.value))}"
            was, is_ = (
                f"{place(one_.path)}  says {one} {shown}" for one in (min(then), one_.state)
            )
            yield Odd(one_.t - began, one_.path, was, is_, one_.after)


def _between(
    messages: Mapping[str, Sequence[Mapping[str, Any]]], key: str, begin: float, end: float
) -> Iterator[Mapping[str, Any]]:
    """Yield the messages of a topic, in any namespace, from `begin` until before `end`."""
    topic = f"/{key.strip('/')}"
    for name, of_topic in messages.items():
        if name.endswith(topic):
            first = bisect_left(of_topic, begin, key=_time)
            yield from of_topic[first : bisect_left(of_topic, end, key=_time)]


def _time(record: Mapping[str, Any]) -> float:
    return float(record["t"])


def _add(known: dict[str, set[str]], one: Mapping[str, Any], said: str) -> None:
    known.setdefault(_text_of(one.get("value")), set()).add(said)


def _text_of(value: Any) -> str:
    return json.dumps(_plain(value), sort_keys=True)


def place(path: str) -> str:
    """Return the path of a state as it is told to people: without the machine."""
    return path.partition("/")[2].partition("/")[2] or path.strip("/")


def compare(
    recorded: Sequence[Step],
    now: Sequence[Step],
    *,
    is_complete: bool = True,
    limits: Mapping[str, Collection[float]] = MappingProxyType({}),
    changed: Collection[str] = (),
    odds: Iterable[Odd] = (),
) -> Comparison:
    """Compare a run with its recording.

    Args:
        recorded: The recorded steps.
        now: Those of the run.
        is_complete: The recording has the end of the run: nothing may follow.
        limits: What `limit_changes` returns: a state that takes another time for it differs.
        changed: Paths of the states of which the code may have changed: one that takes longer
            differs.
        odds: What differs besides the steps.
    """
    ours, theirs = _lanes(now), _lanes(recorded)
    found: list[tuple[float, float, Difference]] = []
    for odd in odds:
        known = (lane for lane in theirs if f"{odd.path}/".startswith(f"{lane}/"))
        lane = max(known, key=len, default="")
        old, new = theirs.get(lane, []), ours.get(lane, [])
        at = sum(step.index < odd.after for step in new)
        number = 1 + (old[at - 1].number if 0 < at <= len(old) else 0)
        one = Difference(
            number,
            odd.at,
            odd.path,
            tuple(step.words() for step in new[max(0, at - 2) : at]),
            odd.recorded,
            odd.now,
            tuple(step.words() for step in old[at : at + 1]),
            tuple(step.words() for step in new[at : at + 1]),
        )
        # It is the cause of what follows at that moment.
        found.append((odd.at, number - 0.5, one))
    for lane in {**theirs, **ours}:
        old, new = theirs.get(lane, []), ours.get(lane, [])
        pairs = enumerate(zip(old, new, strict=False))
        differs = (
            n
            for n, (then, now_) in pairs
            if not then.is_same(now_)
            or _follows(then, now_, limits)
            or _sleeps_longer(then, now_, changed)
        )
        at = next(differs, min(len(old), len(new)))
        if at == len(old) and (at == len(new) or not is_complete):
            continue
        first = min((steps[at] for steps in (old, new) if at < len(steps)), key=lambda s: s.at)
        found.append((first.at, first.number, _difference(old, new, at, first.at)))
    if not found:
        return Comparison(len(recorded), len(recorded))
    # Of two at one moment, the one that came first: a state ends before what it is in.
    difference = min(found, key=lambda one: one[:2])[2]
    return Comparison(difference.number - 1, len(recorded), difference)


def _lanes(steps: Iterable[Step]) -> dict[str, list[Step]]:
    found: defaultdict[str, list[Step]] = defaultdict(list)
    for step in steps:
        found[step.lane].append(step)
    return found


def _apart(then: Any, now: Any) -> tuple[Any, Any]:
    """Return two values with only the fields that differ, if they are long."""
    if not (isinstance(then, dict) and isinstance(now, dict)):
        return then, now
    if max(len(literal(then)), len(literal(now))) <= _SHORT:
        return then, now
    left: tuple[dict[str, Any], dict[str, Any]] = ({}, {})
    for key in dict.fromkeys([*then, *now]):
        is_name = key.startswith("$") or not isinstance(then.get(key), dict | list)
        if then.get(key) == now.get(key) and not (is_name and _is_kept(key)):
            continue
        parts = _apart(then.get(key), now.get(key))
        for one, value, part in zip(left, (then, now), parts, strict=True):
            if key in value:
                one[key] = part
    return left


def _is_kept(key: str) -> bool:
    """Whether a field that is the same is shown: the kind of a value, and what a step names."""
    return key.startswith("$") or key in {"action", "key", "status", "cancelled"}


def _difference(old: list[Step], new: list[Step], at: int, when: float) -> Difference:
    then = old[at] if at < len(old) else None
    now = new[at] if at < len(new) else None
    known = then or now
    assert known is not None
    where = place(known.path)
    goes_on = f"{where}  goes on", f"{where}  nothing of that"
    then_words = "ended before" if then is None else then.words()
    if then is not None and now is not None and then.is_same(now):
        then_words = then.words(f" after {then.took:.1f} s")
        now_words = now.words(f" after {now.took:.1f} s")
    elif now is not None and (
        then is None or now.at <= then.at + GOES_ON_S or then.kind == now.kind == "TimedOut"
    ):
        now_words = now.words()
        if then is not None and (then.kind, then.path) == (now.kind, now.path):
            apart = _apart(dict(then.facts), dict(now.facts))
            then_words, now_words = (
                replace(step, facts=tuple(facts.items())).words()
                for step, facts in zip((then, now), apart, strict=True)
            )
    elif then is not None and then.kind in {"Left", "GoalDone", "Finished", "PreemptRequested"}:
        now_words = goes_on[0]
    else:
        now_words = goes_on[1]
    return Difference(
        number=known.number,
        at=when,
        path=known.path,
        before=tuple(step.words() for step in old[max(0, at - 2) : at]),
        recorded=then_words,
        now=now_words,
        recorded_next=tuple(step.words() for step in old[at + 1 : at + 2]),
        now_next=tuple(
            step.words()
            for step in new[at + (now is not None and not now_words.startswith(goes_on)) :][:1]
        ),
        later=new[at - 1].at - old[at - 1].at if at else 0.0,
    )
