"""Explains how a run ended: the causes from the first one to the outcome, from its events alone.

Pure: no files, no time, no network. A step is the end of a state or the cause of one; each step
follows from the previous one.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

from smachpy.events import answered_text, asker_text, resource_text
from smachpy.events.outcome_classes import is_good, outcome_class
from smachpy.events.run_state import RAISED, innermost
from smachpy.userdata.shown import brief
from smachpy_viz.model.labels import cleanups, shorten, tidies
from smachpy_viz.model.reads import BEGINS, begin_of, values_read

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from smachpy.events.introspection import StateRecord
    from smachpy.events.outcome_classes import OutcomeClass

ENDS = frozenset({"Left", "Failed", "Finished"})
MAX_EARLIER_CAUSES = 10
"""The longest chain of failed states that is shown for one machine."""

HELD = 50_000
"""Events that are held in memory before those that explain nothing are dropped."""

MAX_KEYS = 8
MAX_VALUE_LENGTH = 300


@dataclass(frozen=True, slots=True)
class Cause:
    """One cause in the chain.

    Attributes:
        path: The state.
        stamp_ns: When [ns since the epoch].
        what: What happened, in words: "aborted", "goal to move_base: LOST".
        kind: Class of its outcome, or of the outcome it led to (`smachpy.events.outcome_classes`).
        reason: Why, or what it led to; may be "".
        detail: More lines, such as a traceback; may be "".
        written: The userdata that the state wrote: key, value, and the value before ("" if there
            was none), as texts.
        outcome: The outcome, if the step is the end of a state; else "".
        read: What the state read at its begin: key, value, path of the state that had written it,
            and when [ns since the epoch].
    """

    path: str
    stamp_ns: int
    what: str
    kind: str
    reason: str = ""
    detail: str = ""
    written: tuple[tuple[str, str, str], ...] = ()
    outcome: str = ""
    read: tuple[tuple[str, str, str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Explanation:
    """The newest run of a machine, and the causes of its end.

    Attributes:
        label: Name of the machine.
        outcome: The outcome; "exception" if its code raised; None if it has not ended or its end is
            missing.
        began: When [ns since the epoch]; None if it never ran.
        ended: When, or the time of the last known event.
        steps: From the first cause to the outcome; if it has not ended, the states that ran last.
    """

    label: str
    outcome: str | None
    began: int | None
    ended: int | None
    steps: tuple[Cause, ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data, with its text."""
        return {**asdict(self), "text": self.text()}

    def text(self) -> str:
        """Return it as text, one step per line."""
        if self.began is None or self.ended is None:
            return f"{self.label}: has not run"
        began = self.began
        took = (self.ended - began) / 1e9
        head = (
            f"{self.label}: no end is recorded; after {took:.2f} s there ran:"
            if self.outcome is None
            else f"{self.label}: {shorten(self.outcome, MAX_VALUE_LENGTH)} "
            f"after {took:.2f} s, because:"
        )
        lines = [head]
        for number, step in enumerate(self.steps, 1):
            at = (step.stamp_ns - began) / 1e9
            reason = f": {step.reason}" if step.reason else ""
            lines.append(f"{number:3}. {at:8.2f}  {step.path} {step.what}{reason}")
            lines += [f"               {line}" for line in step.detail.splitlines()]
            for key, value, writer, stamp_ns in step.read:
                when = f"{writer} at {max(0.0, (stamp_ns - began) / 1e9):.2f}"
                lines.append(f"               read {key} = {value} (of {when})")
            for key, value, before in step.written:
                was = f" (was {before})" if before else ""
                lines.append(f"               wrote {key} = {value}{was}")
        return "\n".join(lines)


def why(record: StateRecord, events: Iterable[dict[str, Any]], *, held: int = HELD) -> Explanation:
    """Return the causes of the end of a machine's newest run.

    Args:
        record: The machine.
        events: Its events in order, as `smachpy.events.to_record` makes them; the oldest may be
            missing. They are iterated once, and a long run is not held as a whole.
        held: About how many events are in memory at once; the explanation is the same with any.
    """
    run = newest_run(_explaining(record, events, held), record.path)
    if not run:
        return Explanation(record.label, None, None, None)
    ends = [i for i, event in enumerate(run) if _is(event, "Finished", record.path)]
    began = run[0].get("began_ns", run[0]["stamp_ns"])
    reader = _CauseFinder(record, run)
    if not ends:
        return Explanation(record.label, None, began, run[-1]["stamp_ns"], reader.running())
    end = run[ends[-1]]
    steps = reader.causes(record.path, ends[-1])
    return Explanation(record.label, end.get("outcome") or RAISED, began, end["stamp_ns"], steps)


def newest_run(events: Sequence[dict[str, Any]], root: str) -> list[dict[str, Any]]:
    """Return the events of the newest run of the machine at `root`.

    A run that another process continued is one run. Ends that states got only because the first
    process ended are left out if the second process continues those states.
    """
    begins = [i for i, event in enumerate(events) if _is(event, "Started", root)]
    run = list(events[begins[-1] :] if begins else events)
    for at in [i for i, event in enumerate(run) if _is(event, "Recovered", root)]:
        since = dict(run[at]["active"])
        for i, event in enumerate(run[:at]):
            ends = event["kind"] in ENDS
            if ends and event["stamp_ns"] >= since.get(event["path"], _NEVER):
                run[i] = _PASSED
    return [event for event in run if event is not _PASSED]


def _explaining(
    record: StateRecord, events: Iterable[dict[str, Any]], held: int
) -> list[dict[str, Any]]:
    """Return the events of the newest run without most of those that explain nothing."""
    concurrences = frozenset(one.path for one in record.walk() if one.kind == "concurrence")
    run: list[dict[str, Any]] = []
    limit = held
    for event in events:
        if _is(event, "Started", record.path):
            run.clear()
        run.append(event)
        if len(run) > limit:
            run = _thinned(newest_run(run, record.path), concurrences)
            limit = max(held, 2 * len(run))
    return run


def _thinned(run: list[dict[str, Any]], concurrences: frozenset[str]) -> list[dict[str, Any]]:
    """Return the beginning of a run without what explains nothing, however the run goes on.

    Of the visits in a container, other than a concurrence, the last ones explain its end. Others
    explain what was written before a later visit began. Of what one visit does several times, the
    last explains.
    """
    kept: list[dict[str, Any]] = []
    ended: dict[str, int] = {}  # container -> visits in its present visit
    passed: set[str] = set()  # states whose visit is left out
    told: dict[str, set[str]] = {}  # state -> kinds of events in its present visit
    written: set[tuple[str, str]] = set()  # state and key, before the next begin of a visit
    for event in reversed(run[1:]):
        path, kind = event["path"], event["kind"]
        container = path.rpartition("/")[0]
        if kind in ENDS:
            ended[path] = 0
            told.pop(path, None)
            ended[container] = number = ended.get(container, 0) + 1
            # One more, as the clean-up at the end is no cause.
            if number > MAX_EARLIER_CAUSES + 2 and container not in concurrences:
                passed.add(path)
        is_passed = any(path == one or path.startswith(f"{one}/") for one in passed)
        if kind in BEGINS:
            passed.discard(path)
            told.pop(path, None)
            if not is_passed:
                written.clear()
        if kind == "UserdataWritten":
            explains = (path, event["key"]) not in written
            written.add((path, event["key"]))
        elif is_passed or kind not in _EXPLAINING:
            explains = False
        else:
            kinds = told.setdefault(path, set())
            explains = kind not in kinds or kind == "PreemptRequested"
            kinds.add(kind)
        if explains or not kept:  # the last one says how long the run took
            kept.append(event)
    return [run[0], *reversed(kept)]


_PASSED: dict[str, Any] = {"kind": "", "path": "", "stamp_ns": 0}
_NEVER = 2**64  # later than any stamp [ns]


def _is(event: dict[str, Any], kind: str, path: str) -> bool:
    return bool(event["kind"] == kind and event["path"] == path)


class _CauseFinder:
    """Follows the causes of one run backwards."""

    def __init__(self, record: StateRecord, run: list[dict[str, Any]]) -> None:
        self._states = states = {one.path: one for one in record.walk()}
        self._cleanups = cleanups(record)
        self._parents = {child.path: one for one in states.values() for child in one.children}
        self._run = run

    def causes(self, path: str, end: int) -> tuple[Cause, ...]:
        """Return the steps that led to the end of a state (event number `end`), and that end."""
        begin = begin_of(self._run, path, end)
        outcome = self._outcome(end)
        state = self._states.get(path)
        led = self._led(path, end)
        own = self._step(
            path,
            end,
            outcome,
            led,
            written=self._written(path, begin, end),
            read=self._read(path, begin),
        )
        request = self._first("PreemptRequested", path, begin, end)
        if request is not None and self._class(path, outcome) == "preempted":
            return (*self._request(request), own)
        if state is None or not state.children:
            first = self._own_cause(path, begin, end, outcome)
            return (first, own) if first is not None else (own,)
        return (*self._children(state, begin, end, outcome), own)

    def running(self) -> tuple[Cause, ...]:
        """Return a step for each innermost state that has not ended."""
        active: dict[str, int] = {}
        for i, event in enumerate(self._run):
            if event["kind"] in {"Started", "Entered"}:
                active[event["path"]] = i
            elif event["kind"] == "Recovered":
                active = {path: active.get(path, i) for path, _ in event["active"]}
            elif event["kind"] in ENDS:
                active.pop(event["path"], None)
        found = []
        for path in innermost(active):
            event = self._run[active[path]]
            cause = self._own_cause(path, active[path], len(self._run), "")
            reason = "" if cause is None else ": ".join(filter(None, (cause.what, cause.reason)))
            is_cleanup = tidies(path, self._cleanups)
            what = "entered, to tidy up, and not left" if is_cleanup else "entered, and not left"
            found.append(Cause(path, event["stamp_ns"], what, "other", reason))
        return tuple(found)

    # -- parts -----------------------------------------------------------------------------------

    def _class(self, path: str, outcome: str) -> OutcomeClass:
        state = self._states.get(path)
        return outcome_class(outcome) if state is None else state.class_of(outcome)

    def _is_good(self, end: int) -> bool:
        return self._class(self._run[end]["path"], self._outcome(end)) in {"success", "other"}

    def _step(self, path: str, at: int, what: str, reason: str = "", **more: Any) -> Cause:
        kind = "failure" if what == RAISED else self._class(path, what)
        stamp = self._run[at]["stamp_ns"]
        return Cause(
            path, stamp, shorten(what, MAX_VALUE_LENGTH), kind, reason, outcome=what, **more
        )

    def _outcome(self, end: int) -> str:
        return self._run[end].get("outcome") or RAISED

    def _first(self, kind: str, path: str, begin: int, end: int) -> int | None:
        found = (i for i in range(begin, end) if _is(self._run[i], kind, path))
        return next(found, None)

    def _written(self, path: str, begin: int, end: int) -> tuple[tuple[str, str, str], ...]:
        values: dict[str, Any] = {}
        for event in self._run[begin:end]:
            if _is(event, "UserdataWritten", path):
                values.pop(event["key"], None)  # in the order of the last writes
                values[event["key"]] = event["value"]
        container = path.rpartition("/")[0]
        before = {
            event["key"]: event["value"]
            for event in self._run[:begin]
            if event["kind"] == "UserdataWritten"
            and event["path"].rpartition("/")[0] == container
            and event["key"] in values
        }
        return tuple(
            (shorten(key, 80), _short(value), _short(before[key]) if key in before else "")
            for key, value in [*values.items()][-MAX_KEYS:]
        )

    def _read(self, path: str, begin: int) -> tuple[tuple[str, str, str, int], ...]:
        """Return what a state without states inside read; a container only hands it on."""
        if self._states.get(path) is None or self._states[path].children:
            return ()
        found = list(values_read(self._states, self._run, path, begin))[:MAX_KEYS]
        return tuple(
            (shorten(key, 80), _short(event["value"]), event["path"], event["stamp_ns"])
            for key, event in found
        )

    def _request(self, at: int) -> tuple[Cause, ...]:
        """Return who asked a state to stop; if it was a sibling's end, the causes of that end."""
        event = self._run[at]
        by = event.get("by") or ""
        if event.get("source") == "concurrence" and by in self._states:
            ends = [
                i
                for i in range(at, -1, -1)
                if self._run[i]["path"] == by and self._run[i]["kind"] in ENDS
            ]
            if ends:
                return self.causes(by, ends[0])
        asker = asker_text(event.get("source") or "program", by, event.get("why") or "")
        what = f"asked to stop by {shorten(asker, MAX_VALUE_LENGTH)}"
        return (Cause(event["path"], event["stamp_ns"], what, "preempted"),)

    def _own_cause(self, path: str, begin: int, end: int, outcome: str) -> Cause | None:
        """Return the strongest cause within a visit, other than the end of another state."""
        found: dict[str, dict[str, Any]] = {}
        attempts = 1
        for event in self._run[begin : end + 1]:
            if event["path"] == path:
                found[event["kind"]] = event
                attempts = event["attempt"] + 1 if event["kind"] == "Retried" else attempts
        tries = f"in attempt {attempts}" if attempts > 1 else ""
        kind = self._class(path, outcome) if outcome else "other"
        for name, tell in _CAUSES.items():
            told = tell(found[name]) if name in found else None
            if told is not None:
                what, reason, detail = told
                reason = ", ".join(filter(None, (reason, tries)))
                stamp = found[name]["stamp_ns"]
                return Cause(path, stamp, shorten(what, MAX_VALUE_LENGTH), kind, reason, detail)
        return None

    def _children(
        self, state: StateRecord, begin: int, end: int, outcome: str
    ) -> tuple[Cause, ...]:
        """Return the steps to the end of the child that decided, with the failures before it."""
        children = {child.path for child in state.others}  # the clean-up decides nothing
        ends = [
            i
            for i in range(begin, end)
            if self._run[i]["kind"] in ENDS and self._run[i]["path"] in children
        ]
        if not ends:
            first = self._own_cause(state.path, begin, end, outcome)
            return () if first is None else (first,)
        if state.kind == "concurrence":
            decided = self._deciding(state, begin, end, ends, outcome)
            return self.causes(self._run[decided]["path"], decided)
        chain = [ends[-1]]
        # Backwards while the states failed: a failure whose recovery failed too belongs to the
        # causes. A good outcome ends the chain: everything before it had been recovered from.
        for i in reversed(ends[:-1]):
            if self._is_good(i) or len(chain) > MAX_EARLIER_CAUSES:
                break
            chain.insert(0, i)
        return tuple(step for i in chain for step in self.causes(self._run[i]["path"], i))

    def _deciding(
        self, state: StateRecord, begin: int, end: int, ends: list[int], outcome: str
    ) -> int:
        """Return the end of the child that decided a concurrence.

        In this order: the one that preempted its siblings, the first failure if the concurrence
        failed or fell back to its default, the last end.
        """
        askers = [
            event["by"]
            for event in self._run[begin:end]
            if event["kind"] == "PreemptRequested"
            and event.get("source") == "concurrence"
            and event["path"].startswith(f"{state.path}/")
        ]
        for asker in askers:
            for i in ends:
                if self._run[i]["path"] == asker:
                    return i
        if not is_good(outcome, state.success) or outcome == state.default_outcome:
            bad = [i for i in ends if not self._is_good(i)]
            if bad:
                return bad[0]
        return ends[-1]

    def _next_in(self, parent: StateRecord, end: int) -> str | None:
        """Return the label of the child that began next, or the outcome of the container."""
        for event in self._run[end + 1 :]:
            above, _, label = event["path"].rpartition("/")
            if event["kind"] == "Entered" and above == parent.path:
                return str(label)
            if event["kind"] in ENDS and event["path"] == parent.path:
                return event.get("outcome")
        return None

    def _led(self, path: str, end: int) -> str:
        """Return in words what the outcome of a state led to in its container."""
        parent = self._parents.get(path)
        state = self._states.get(path)
        if parent is None or state is None:
            return ""
        outcome = self._outcome(end)
        if outcome == RAISED:
            return f"nothing in {parent.label} catches it"
        ways = [
            edge
            for edge in parent.transitions
            if (edge.source, edge.outcome) == (state.label, outcome)
        ]
        # With conditions it is the one to the state that began next, or the last one.
        following = self._next_in(parent, end)
        for edge in sorted(ways, key=lambda edge: edge.target != following):
            falls = f"no transition for it, so the outcome of {parent.label}"
            reason = f", as {shorten(edge.guard, 80)}" if edge.guard else ""
            return falls if edge.implicit else f"leads to {shorten(edge.target, 80)}{reason}"
        if parent.kind != "concurrence":
            return ""
        for rule in parent.rules:
            if (state.label, outcome) in rule.conditions:
                return f"rule for {shorten(rule.outcome, 80)}: {shorten(rule.text, 200)}"
        default = f"; its default is {parent.default_outcome}"
        ended = next(
            (e for e in self._run[end:] if e["kind"] in ENDS and e["path"] == parent.path), {}
        )
        # Another outcome than the default means that a callback decided.
        is_other = ended.get("outcome") not in {None, parent.default_outcome}
        return f"no rule of {parent.label} names it{'' if is_other else default}"


def _goal(event: dict[str, Any]) -> tuple[str, str, str] | None:
    if event["status"] == "SUCCEEDED":
        return None
    text = shorten(event.get("text") or "", MAX_VALUE_LENGTH)
    return f"goal to {event['action']}: {event['status']}", text, ""


_CAUSES: dict[str, Any] = {
    "OutcomeForced": lambda e: ("ended by an operator", f"with {e['outcome']!r}", ""),
    "Failed": lambda e: (f"raised {e['error']}", "", e.get("trace") or ""),
    "Abandoned": lambda e: (f"ignored its preempt for {e['grace']:g} s", "abandoned", e["stack"]),
    "ResourceUse": lambda e: (
        (resource_text(e["status"], e["resource"], e["holder"]), "", "")
        if e["status"] in {"waits", "refused"}
        else None
    ),
    "QuestionAnswered": lambda e: (answered_text(e["answer"], e["by"]), "", ""),
    "TimedOut": lambda e: (f"ran into its timeout of {e['timeout']:g} s", "", ""),
    "GoalDone": _goal,
    "Retried": lambda e: ("tried again", shorten(str(e["reason"]), MAX_VALUE_LENGTH), ""),
    "PreemptRequested": lambda e: (
        "asked to stop by "
        + asker_text(e.get("source") or "program", e.get("by") or "", e.get("why") or ""),
        "",
        "",
    ),
}
"""The causes that events tell, as (what, reason, more lines); the strongest first."""

_EXPLAINING = ENDS | BEGINS | _CAUSES.keys() | {"Recovered"}


def _short(value: Any) -> str:
    return shorten(brief(value), 120)
