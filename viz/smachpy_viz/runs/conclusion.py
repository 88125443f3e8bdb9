"""What many runs of a machine have in common, in a headline; pure.

No cause is claimed under three failures. What is said of varied values is what is so in these runs:
that all failures of a kind have a value up to, or from, a number, and how many other runs have too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

from smachpy.events.run_state import RAISED
from smachpy_viz.model.labels import shorten
from smachpy_viz.model.why import newest_run, why

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from smachpy.events.introspection import StateRecord

FEWEST: Final = 3
"""Failures under which nothing is concluded."""

PURE: Final = 0.8
"""So great a part of the runs within the bounds of the failures must have failed."""

_NUMBER: Final = re.compile(r"\d+([.,]\d+)*")


@dataclass(frozen=True, slots=True)
class RunEnd:
    """How one run ended.

    Attributes:
        good: Whether with a good outcome.
        path: The state that ended badly first on the way to the end, "" without one.
        cause: The first cause in words, "" without one.
        at: When that was [s after the begin].
        place: Where the robot was last [m], as far as its feedback says.
    """

    good: bool
    path: str = ""
    cause: str = ""
    at: float = 0.0
    place: tuple[float, float] | None = None

    @property
    def kind(self) -> tuple[str, str]:
        """State and cause without numbers: the same for failures of one kind."""
        return self.path, _NUMBER.sub("#", self.cause)


def end_of(record: StateRecord, events: Sequence[dict[str, Any]]) -> RunEnd:
    """Return how the newest run of a machine ended."""
    run = newest_run(events, record.path)
    place = next((p for e in reversed(run) if (p := _place(e)) is not None), None)
    last = next((e for e in reversed(run) if e["kind"] == "Finished"), None)
    outcome = None if last is None else last.get("outcome") or RAISED
    if outcome not in {None, RAISED} and record.class_of(str(outcome)) in {"success", "other"}:
        return RunEnd(good=True, place=place)
    found = why(record, events)
    if not found.steps or found.began is None:
        return RunEnd(good=False, place=place)
    first = found.steps[0]
    # The end of a state says nothing that its name does not: the text of its goal or error does.
    cause = first.reason if first.what.startswith("goal to ") and first.reason else first.what
    at = (first.stamp_ns - found.began) / 1e9
    return RunEnd(good=False, path=first.path, cause=shorten(cause, 120), at=at, place=place)


def _place(event: Mapping[str, Any]) -> tuple[float, float] | None:
    """Return the place in the feedback of a drive; None for other events."""
    value: Any = event.get("feedback") if event["kind"] == "GoalFeedback" else None
    for name in ("base_position", "current_pose"):
        fields = value.get("fields") if isinstance(value, dict) else None
        if isinstance(fields, dict) and name in fields:
            value = fields[name]
            break
    else:
        return None
    for name in ("pose", "position"):
        fields = value.get("fields") if isinstance(value, dict) else None
        value = fields.get(name) if isinstance(fields, dict) else None
    fields = value.get("fields") if isinstance(value, dict) else None
    x, y = (fields.get("x"), fields.get("y")) if isinstance(fields, dict) else (None, None)
    return (
        (float(x), float(y)) if isinstance(x, int | float) and isinstance(y, int | float) else None
    )


def by_cause(ends: Iterable[RunEnd]) -> list[tuple[RunEnd, list[int]]]:
    """Return the kinds of failures, the commonest first, each with the numbers of its runs."""
    found: dict[tuple[str, str], tuple[RunEnd, list[int]]] = {}
    for number, end in enumerate(ends):
        if not end.good:
            found.setdefault(end.kind, (end, []))[1].append(number)
    return sorted(found.values(), key=lambda one: -len(one[1]))


@dataclass(frozen=True, slots=True)
class Bound:
    """A bound that all failures keep: a value up to `limit`, or from it on if `above`."""

    key: str
    limit: float
    above: bool

    def holds(self, value: float) -> bool:
        """Return whether a value is within it."""
        return value >= self.limit if self.above else value <= self.limit

    def words(self) -> str:
        """Return it in words."""
        return f"{self.key} {'from' if self.above else 'up to'} {self.limit:.3g}"


def bounds(
    ends: Sequence[RunEnd], failed: Iterable[int], values: Sequence[Mapping[str, float]]
) -> tuple[Bound, ...]:
    """Return the one bound, or the two, that part some failures best from the good runs.

    Args:
        ends: How the runs ended.
        failed: Numbers of the failures.
        values: The varied numbers of each run.

    Returns:
        Nothing if fewer than 80 % of the runs within the bounds have failed.
    """
    bad = list(failed)
    keys = [key for key in values[bad[0]] if all(key in one for one in values)] if bad else []
    one = [
        Bound(key, pick(values[i][key] for i in bad), above)
        for key in keys
        for above, pick in ((False, max), (True, min))
    ]
    pairs = [pair for pair in combinations(one, 2) if pair[0].key != pair[1].key]
    for candidates in ([(bound,) for bound in one], pairs):
        rated = [(_purity(ends, values, some), some) for some in candidates]
        if rated and (best := max(rated, key=lambda pair: pair[0]))[0] >= PURE:
            return best[1]
    return ()


def _purity(
    ends: Sequence[RunEnd], values: Sequence[Mapping[str, float]], some: tuple[Bound, ...]
) -> float:
    """Return the part of the runs within bounds that has failed; 0 if all runs are within."""
    inside = [
        end
        for end, one in zip(ends, values, strict=True)
        if all(bound.holds(one[bound.key]) for bound in some)
    ]
    return 0.0 if len(inside) == len(ends) else sum(not e.good for e in inside) / len(inside)


def headline(ends: Sequence[RunEnd], values: Sequence[Mapping[str, float]]) -> tuple[str, str]:
    """Return two sentences: how many succeeded, and what the failures share.

    Args:
        ends: How the runs ended.
        values: The varied numbers of each run, in the same order.
    """
    good = sum(end.good for end in ends)
    first = f"{good} of {len(ends)} succeeded."
    kinds = by_cause(ends)
    bad = len(ends) - good
    if not bad:
        return first, ""
    if bad < FEWEST:
        return first, f"{bad} failed: too few to say what they have in common."
    end, numbers = kinds[0]
    which = f"All {bad} failures" if len(numbers) == bad else f"{len(numbers)} of {bad} failures"
    state = end.path.rpartition("/")[2]
    if len(numbers) < FEWEST:
        return first, f"{bad} failed, of {len(kinds)} causes: no common one."
    text = f"{which}: {end.cause or 'no known cause'}{f' in {state}' if state else ''}"
    found = bounds(ends, numbers, values)
    shared = " and ".join(bound.words() for bound in found)
    return first, f"{text}, {f'every one with {shared}' if shared else 'no common value found'}."
