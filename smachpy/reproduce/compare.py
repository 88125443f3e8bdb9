"""Compares a run with its recording, and finds the first difference; pure.

Branches that run side by side have no order between them that a mission could rely on: each is
compared for itself, and the difference that came first counts.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.inputs.suggest import did_you_mean
from smachpy.command.evidence import NOTE
from smachpy.userdata.shown import literal

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

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
    "TimedOut": (),
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
    """

    number: int
    at: float
    kind: str
    path: str
    facts: tuple[tuple[str, Any], ...]
    lane: str

    @property
    def sameness(self) -> Any:
        """Equal for equal steps."""
        return self.kind, self.path, self.facts

    def words(self) -> str:
        """Return the step in words for people."""
        facts = {
            key: literal(value) if not isinstance(value, str) else value
            for key, value in self.facts
        }
        place = self.path.partition("/")[2].partition("/")[2] or self.path.strip("/")
        said = _SAID.get(self.kind, self.kind)
        try:
            return f"{place}  {said.format(**facts)}"
        except (KeyError, ValueError):
            return f"{place}  {self.kind} {facts}"


_SAID: Final = {
    "Started": "begins",
    "Finished": "ends: {outcome}",
    "Entered": "begins",
    "Left": "{outcome}",
    "Failed": "raises {error}",
    "PreemptRequested": "is asked to stop ({source})",
    "Preempted": "is preempted",
    "Abandoned": "does not stop, and is left behind",
    "TimedOut": "runs into its timeout",
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
    left_out = {kind for name in tolerate for kind in GROUPS.get(name, ())}
    found: list[Step] = []
    began: float | None = None
    for event in events:
        kind, path, t = event["kind"], event["path"], event.get("t", 0.0)
        began = t if began is None else began
        names = FIELDS.get(kind)
        if names is None or kind in left_out or _is_tolerated(event, tolerate):
            continue
        if kind == "Noted" and path == record.path and str(event.get("text")).startswith(NOTE):
            continue  # of the evidence that there was, and not of the run
        facts = {name: _plain(event.get(name)) for name in names}
        if "error" in facts:  # further lines list threads and places
            facts["error"] = str(facts["error"]).partition("\n")[0]
        if "cancelled" in facts:
            facts["cancelled"] = event.get("goal_id") in cancelled
        number = len(found) + 1
        found.append(
            Step(number, t - began, kind, path, tuple(facts.items()), _lane(path, parallel))
        )
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


def _is_tolerated(event: Mapping[str, Any], tolerate: Collection[str]) -> bool:
    path = event["path"]
    for name in tolerate:
        word = name.strip("/")
        if event.get("key") == word or f"{path}/".endswith(f"/{word}/") or f"/{word}/" in path:
            return True
    return False


def _plain(value: Any) -> Any:
    """Return a value without the stamps of headers."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items() if key not in _STAMPS}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _lane(path: str, parallel: Iterable[str]) -> str:
    above = max((one for one in parallel if path.startswith(f"{one}/")), key=len, default="")
    return f"{above}/{path.removeprefix(above).split('/')[1]}" if above else ""


def compare(
    recorded: Sequence[Step], now: Sequence[Step], *, is_complete: bool = True
) -> Comparison:
    """Compare a run with its recording.

    Args:
        recorded: The recorded steps.
        now: Those of the run.
        is_complete: The recording has the end of the run: nothing may follow.
    """
    ours, theirs = _lanes(now), _lanes(recorded)
    found: list[tuple[float, int, Difference]] = []
    for lane in {**theirs, **ours}:
        old, new = theirs.get(lane, []), ours.get(lane, [])
        pairs = enumerate(zip(old, new, strict=False))
        differs = (n for n, (then, now_) in pairs if then.sameness != now_.sameness)
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


def _difference(old: list[Step], new: list[Step], at: int, when: float) -> Difference:
    then = old[at] if at < len(old) else None
    now = new[at] if at < len(new) else None
    known = then or now
    assert known is not None
    place = known.words().partition("  ")[0]
    then_words = "ended before" if then is None else then.words()
    if now is not None and (then is None or now.at <= then.at + GOES_ON_S):
        now_words = now.words()
    elif then is not None and then.kind in {"Left", "GoalDone", "Finished", "PreemptRequested"}:
        now_words = f"{place}  goes on"
    else:
        now_words = f"{place}  nothing of that"
    return Difference(
        number=known.number,
        at=when,
        path=known.path,
        before=tuple(step.words() for step in old[max(0, at - 2) : at]),
        recorded=then_words,
        now=now_words,
        recorded_next=tuple(step.words() for step in old[at + 1 : at + 2]),
        now_next=tuple(
            step.words() for step in new[at + (now is not None and now.words() == now_words) :][:1]
        ),
        later=new[at - 1].at - old[at - 1].at if at else 0.0,
    )
