"""How a run that failed differs from good runs of the same machine, at the state that failed; pure.

No cause is claimed: what is told is what the state read and how long it took, here and in good
runs. Under three good runs nothing is told.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

from smachpy.userdata.shown import brief
from smachpy_viz.model.labels import shorten
from smachpy_viz.model.reads import begin_of, values_read
from smachpy_viz.model.why import ENDS, newest_run, why

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from smachpy.events.introspection import StateRecord

    Run = tuple[StateRecord, Sequence[dict[str, Any]]]

FEWEST: Final = 3
"""Good runs without which nothing is told."""

MOST_VALUES: Final = 100
"""Values of good runs that are kept of each fact."""

MOST_TEXTS: Final = 5
TOOK: Final = "took"


@dataclass(slots=True)
class Fact:
    """Something about a visit that can be compared.

    Attributes:
        name: A key that the state reads, or "took".
        unit: "s", or "".
        here: In the run that failed, as text.
        number: The same as a number; None if it is none.
        good: Numbers of good runs.
        texts: Other values of good runs, each once.
        differs: Whether no good run has such a value: a number is outside all of them.
    """

    name: str
    unit: str
    here: str
    number: float | None
    good: list[float] = field(default_factory=list)
    texts: list[str] = field(default_factory=list)
    differs: bool = False


@dataclass(slots=True)
class GoodRuns:
    """The comparison.

    Attributes:
        path: The state that failed; "" if there is none.
        runs: Number of good runs in which it ran.
        facts: What is compared; what was known at its begin comes first.
        text: The conclusion, in a sentence.
    """

    path: str = ""
    runs: int = 0
    facts: list[Fact] = field(default_factory=list)
    text: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return it as plain data."""
        return asdict(self)


def compare_with_good(
    record: StateRecord, events: Sequence[dict[str, Any]], good: Iterable[Run]
) -> GoodRuns:
    """Compare the newest run of a machine with good runs.

    Args:
        record: The machine.
        events: The events of the run.
        good: Machine and events of each good run.
    """
    explained = why(record, events)
    failed = next((step for step in explained.steps if step.outcome), None)
    if failed is None or failed.path == record.path:
        return GoodRuns(text="no state is known to have failed")
    visits = list(_visits(record, events, failed.path))
    if not visits:
        return GoodRuns(failed.path, text="its visit is not among the known events")
    facts = {
        name: Fact(name, "s" if name == TOOK else "", _text(name, value), _number(value))
        for name, value in visits[-1].items()
    }
    runs = 0
    for other, theirs in good:
        seen = list(_visits(other, theirs, failed.path))
        runs += bool(seen)
        for visit in seen:
            for name, value in visit.items():
                if (fact := facts.get(name)) is not None:
                    _add(fact, value)
    for fact in facts.values():
        fact.differs = runs >= FEWEST and _is_other(fact)
    found = GoodRuns(
        failed.path, runs, [fact for fact in facts.values() if fact.good or fact.texts]
    )
    found.text = _conclusion(found)
    return found


def _visits(
    record: StateRecord, events: Sequence[dict[str, Any]], path: str
) -> Iterator[dict[str, Any]]:
    """Yield the facts of each visit of a state that has ended."""
    states = {one.path: one for one in record.walk()}
    run = newest_run(events, record.path)
    for end, event in enumerate(run):
        if event["path"] == path and event["kind"] in ENDS:
            begin = begin_of(run, path, end)
            read = {key: one["value"] for key, one in values_read(states, run, path, begin)}
            yield {**read, TOOK: (event["stamp_ns"] - run[begin]["stamp_ns"]) / 1e9}


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _text(name: str, value: Any) -> str:
    return f"{value:.3g} s" if name == TOOK else shorten(brief(value), 60)


def _add(fact: Fact, value: Any) -> None:
    number = _number(value)
    if number is not None and fact.number is not None:
        if len(fact.good) < MOST_VALUES:
            fact.good.append(number)
    elif len(fact.texts) < MOST_TEXTS and (text := _text(fact.name, value)) not in fact.texts:
        fact.texts.append(text)


def _is_other(fact: Fact) -> bool:
    if fact.number is not None and fact.good:
        return not min(fact.good) <= fact.number <= max(fact.good)
    # Of many different values another one says nothing.
    return 0 < len(fact.texts) < MOST_TEXTS and fact.here not in fact.texts


def _conclusion(found: GoodRuns) -> str:
    if found.runs < FEWEST:
        runs = "no good run" if not found.runs else f"{found.runs} good run(s)"
        return f"{runs} with this state; at least {FEWEST} are compared"
    other = [fact for fact in found.facts if fact.differs]
    if not other:
        return f"as in {found.runs} good runs, as far as it is known"
    told = [f"{fact.name} {fact.here} (good: {_range(fact)})" for fact in other]
    return f"unlike {found.runs} good runs: {', '.join(told)}"


def _range(fact: Fact) -> str:
    if not fact.good:
        return ", ".join(fact.texts)
    low, high = (f"{value:.4g}" for value in (min(fact.good), max(fact.good)))
    unit = f" {fact.unit}" if fact.unit else ""
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"
