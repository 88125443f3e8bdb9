"""A run of a mission in a test: its events, and assertions with readable failures."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass, field
from pathlib import Path
from types import EllipsisType
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from smachpy.events import (
    Abandoned,
    Entered,
    Failed,
    Finished,
    GoalDone,
    GoalSent,
    Left,
    PreemptRequested,
    Retried,
    Started,
    TimedOut,
)
from smachpy.events.pictures import draw_run
from smachpy.exceptions import SmachError, did_you_mean
from smachpy.userdata.secret import masked

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from smachpy.events import Event
    from smachpy.events.introspection import StateRecord

Pattern: TypeAlias = str | EllipsisType

MAX_LINES = 60  # lines in a run's explanation


class UnknownStateError(SmachError):
    """A test names a state that the machine does not have.

    Try: use one of the paths that the error lists.
    """


def find_path(record: StateRecord, name: str) -> str:
    """Return the path of the state with this name, which is a path or the end of one.

    Raises:
        UnknownStateError: no state matches, or more than one.
    """
    paths = [state.path for state in record.walk()]
    if name in paths:
        return name
    found = [path for path in paths if path.endswith("/" + name.strip("/"))]
    if len(found) == 1:
        return found[0]
    known = [*paths, *(path.rpartition("/")[2] for path in paths)]
    what = f"it means {found}" if found else "there is none"
    raise UnknownStateError(
        f"{record.path}: state {name!r}: {what}; expected one of {paths}."
        f"{did_you_mean(name, known)}"
    )


@dataclass(frozen=True, slots=True)
class Run:
    """One run of a machine.

    Attributes:
        record: The machine.
        outcome: Its outcome.
        events: All events, in order.
        userdata: The machine's userdata after the run.
        duration: How long it took on the test's clock [s].
        seed: The seed of its interleaving; None: threads took turns.
        folder: Returns the folder for pictures.
        unfired: The preempts and interrupts of the test that never came, and why.
        whole: The machine without the test's doubles; None if there are none.
        served: Ids of the goals that the test's servers still work on, from any client.
        ignored: Ids of those on which they work although somebody has cancelled them.
    """

    record: StateRecord
    outcome: str | None
    events: tuple[Event, ...]
    userdata: dict[str, Any]
    duration: float
    seed: int | None = None
    folder: Callable[[], Path] = field(default=Path.cwd, repr=False)
    unfired: tuple[str, ...] = ()
    whole: StateRecord | None = field(default=None, repr=False)
    served: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    # -- what happened -------------------------------------------------------------------------

    @property
    def states(self) -> tuple[str, ...]:
        """Paths of the states that were entered, including containers, in order."""
        return tuple(event.path for event in self.events if isinstance(event, Entered))

    @property
    def path(self) -> tuple[str, ...]:
        """Paths of the leaves that were entered, in order."""
        leaves = {state.path for state in self.record.walk() if not state.is_container}
        return tuple(path for path in self.states if path in leaves)

    @property
    def preempted(self) -> bool:
        """Whether anybody asked the machine, or a part of it, to stop."""
        return any(isinstance(event, PreemptRequested) for event in self.events)

    @property
    def active(self) -> tuple[str, ...]:
        """Paths of the states that were active at the end; empty unless the run was aborted."""
        events = list(self.events)
        while self.outcome is None and events and isinstance(events[-1], Failed | Finished):
            events.pop()  # the exception passed through these states and ended them
        active: dict[str, None] = {}
        for event in events:
            if isinstance(event, Entered):
                active[event.path] = None
            elif isinstance(event, Left | Failed):
                active.pop(event.path, None)
        return tuple(active)

    @property
    def goals_left(self) -> tuple[str, ...]:
        """Ids of the goals of states that have not ended, and of those in `served`, `ignored`."""
        sent = {event.goal_id: None for event in self.events if isinstance(event, GoalSent)}
        done = {event.goal_id for event in self.events if isinstance(event, GoalDone)}
        left = [goal_id for goal_id in sent if goal_id not in done]
        return tuple(dict.fromkeys([*left, *self.served, *self.ignored]))

    def visits(self, state: str) -> int:
        """Return how often a state was entered; `state` is a path or the end of one."""
        path = find_path(self.record, state)
        begun = Started if path == self.record.path else Entered
        return sum(isinstance(event, begun) and event.path == path for event in self.events)

    def outcomes(self, state: str) -> tuple[str, ...]:
        """Return the outcomes of a state, in order."""
        path = find_path(self.record, state)
        ended = Finished if path == self.record.path else Left
        found = (e for e in self.events if isinstance(e, ended) and e.path == path)
        return tuple(event.outcome for event in found if event.outcome is not None)

    def timed_out(self, state: str) -> bool:
        """Return whether a state ran into its timeout."""
        return find_path(self.record, state) in self.timeouts()

    def timeouts(self) -> tuple[str, ...]:
        """Return the paths of the states that ran into their timeouts, in order.

        The timeout of a goal, call or wait is the state's own and has no event: it is recognised by
        its duration and outcome.
        """
        own = own_timeouts(self.record)
        begun: dict[str, float] = {}
        found: list[str] = []
        for event in self.events:
            if isinstance(event, TimedOut):
                found.append(event.path)
            elif isinstance(event, Entered | GoalSent):
                begun[event.path] = event.t
            elif isinstance(event, Left | Retried) and event.path in own:
                limit = own[event.path]
                lasted = event.t - begun.get(event.path, event.t)
                ended = event.outcome if isinstance(event, Left) else event.reason
                if lasted >= limit.seconds * (1 - _ROUNDED) and limit.outcome == ended:
                    found.append(event.path)
                if isinstance(event, Retried):
                    begun[event.path] = event.t + limit.backoff * 2.0 ** min(event.attempt - 1, 60)
        return tuple(found)

    def abandoned(self) -> tuple[str, ...]:
        """Return the paths of the states that ignored a preempt and were left behind."""
        return tuple(event.path for event in self.events if isinstance(event, Abandoned))

    # -- assertions ----------------------------------------------------------------------------

    def assert_outcome(self, *expected: str) -> None:
        """Fail unless the run ended with (one of) `expected`."""
        if self.outcome not in expected:
            wanted = " or ".join(map(repr, expected))
            self._fail(f"outcome: got {self.outcome!r}; expected {wanted}.")

    def assert_path(self, expected: Sequence[Pattern]) -> None:
        """Fail unless exactly these leaves ran, in this order.

        Args:
            expected: Paths or ends of paths; `...` matches any number of leaves, including none.
        """
        names = [x if isinstance(x, EllipsisType) else find_path(self.record, x) for x in expected]
        if not _matches(self.path, names):
            lines = ["...   " if isinstance(x, EllipsisType) else x for x in names]
            diff = list(difflib.ndiff(lines, self.path))
            text = "\n".join("  " + line for line in diff if not line.startswith("?"))
            self._fail(f"path (- expected, + got):\n{text}")

    def assert_visited(self, *states: str) -> None:
        """Fail unless all these states ran."""
        missing = [state for state in states if not self.visits(state)]
        if missing:
            self._fail(f"states: {missing} did not run.")

    def assert_not_visited(self, *states: str) -> None:
        """Fail if one of these states ran."""
        ran = [state for state in states if self.visits(state)]
        if ran:
            self._fail(f"states: {ran} ran; expected not.")

    def assert_userdata(self, **expected: object) -> None:
        """Fail unless these keys have these values at the end."""
        missing = object()
        wrong = {
            key: self.userdata.get(key, missing)
            for key, value in expected.items()
            if self.userdata.get(key, missing) != value
        }
        if wrong:
            lines = [
                f"  {key}: got {'no value' if got is missing else repr(masked(got, key))}; "
                f"expected {masked(expected[key], key)!r}"
                for key, got in wrong.items()
            ]
            self._fail("userdata:\n" + "\n".join(lines))

    def assert_duration(self, *, at_most: float, at_least: float = 0.0) -> None:
        """Fail unless the run took between `at_least` and `at_most` [s]."""
        if not at_least <= self.duration <= at_most:
            self._fail(
                f"duration: got {self.duration:g} s; expected {at_least:g} to {at_most:g} s."
            )

    def draw(self, file: Path | str | None = None) -> Path | None:
        """Draw the machine with this run; by default into the test's folder.

        Returns:
            The file, or None if no drawing package is installed.
        """
        if file is None:
            folder = self.folder()
            number = sum(1 for _ in folder.glob(f"{self.record.label}-*.svg")) + 1
            file = folder / f"{self.record.label}-{number}.svg"
        return draw_run(self.record, self.events, Path(file))

    def explain(self) -> str:
        """Return the run in a few lines."""
        lines = [f"run of {self.record.path}: {self.outcome!r} after {self.duration:g} s"]
        lines += [f"  {line}" for line in _summary(self.events)]
        lines += [f"  never came: {text}" for text in self.unfired]
        if self.seed is not None:
            lines.append(f"  seed {self.seed}")
        return "\n".join(lines)

    def _fail(self, text: str) -> None:
        __tracebackhide__ = True
        picture = self.draw()
        shown = "" if picture is None else f"\npicture: {picture}"
        raise AssertionError(f"{text}\n{self.explain()}{shown}")


class TimeLimitError(SmachError):
    """A mission under test exceeded the time limit, or ran endlessly while no time passed.

    Try: look for a loop without a wait, or raise the limit with the call that is named.

    Args:
        run: The run so far.
        limit: Its limit [s].
        steps: What it did while no time passed, in words; "" if the time limit was exceeded.
        call: The function that accepts another limit.

    Attributes:
        run: See above.
    """

    def __init__(self, run: Run, limit: float, steps: str = "", call: str = "mission") -> None:
        self.run = run
        active = ", ".join(run.active) or "nothing"
        what = f"it still ran after {limit:g} s, in {active}; expected an end. Try"
        if steps:
            what = (
                f"{steps} at {run.duration:g} s, in {active}; expected time to pass, "
                "or an end. Let a state or a server take time, or try"
            )
        word = "steps" if steps else "limit"
        super().__init__(f"{run.record.path}: {what} {call}(..., {word}=...).\n{run.explain()}")


def _summary(events: Iterable[Event]) -> list[str]:
    """Return one line per state that ended, and for other important events."""
    lines: list[str] = []
    start: float | None = None
    for event in events:
        start = event.t if start is None else start
        if isinstance(event, Left):
            lines.append(f"{event.t - start:8.3f}  {event.path} -{event.outcome}->")
        elif not isinstance(event, Entered) and type(event).__name__ in _SHOWN:
            fields = ", ".join(
                f"{k}={masked(v, k)}" for k, v in list(event._asdict().items())[3:] if k != "stack"
            )
            lines.append(
                f"{event.t - start:8.3f}  {event.path} {type(event).__name__} {fields}".rstrip()
            )
    if len(lines) > MAX_LINES:
        lines[20:-20] = [f"   ... {len(lines) - 40} more"]
    return lines


_SHOWN = frozenset(
    {"Failed", "PreemptRequested", "Preempted", "Abandoned", "TimedOut", "Retried", "GoalDone"}
)


class OwnTimeout(NamedTuple):
    """The timeout of a goal, call or wait: its seconds and outcome, and the backoff of `retry`."""

    seconds: float
    outcome: str
    backoff: float


def own_timeouts(record: StateRecord) -> dict[str, OwnTimeout]:
    """Return, for leaves with their own timeout, what is known of it."""
    found: dict[str, OwnTimeout] = {}
    for state in record.walk():
        details = dict(state.details)
        seconds, _, text = details.get(_OWN_TIMEOUTS.get(state.kind, ""), "").partition(" s")
        if seconds:
            outcome = text.removeprefix(" -> ") or "aborted"
            backoff = _BACKOFF.search(details.get("retry", ""))
            found[state.path] = OwnTimeout(
                float(seconds), outcome, float(backoff[1]) if backoff else 0.0
            )
    return found


_BACKOFF = re.compile(r"attempts, (\S+) s apart")
_OWN_TIMEOUTS = {
    "service": "timeout",
    "monitor": "timeout",
    "condition": "timeout",
    "action": "exec_timeout",
}
_ROUNDED = 1e-5  # relative; records round seconds to six digits


def _matches(path: Sequence[str], wanted: Sequence[Pattern]) -> bool:
    """Return whether a path matches the patterns; `...` matches any number of steps."""
    # The set of positions at which the patterns so far can end: no backtracking is needed.
    ends = {0}
    for pattern in wanted:
        if isinstance(pattern, EllipsisType):
            ends = set(range(min(ends), len(path) + 1)) if ends else set()
        else:
            ends = {end + 1 for end in ends if end < len(path) and path[end] == pattern}
    return len(path) in ends
