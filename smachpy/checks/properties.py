"""Checks properties of all runs of a machine, and finds a shortest run that violates one."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from smachpy.checks.graph import PREEMPTED, moments
from smachpy.checks.model import Problem
from smachpy.exceptions import SmachError, did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from smachpy.checks.graph import Graph, GraphNode
    from smachpy.checks.model import Subject

    Broken: TypeAlias = tuple[str, list[GraphNode]] | None  # the violation in words, and a run


class PropertyError(SmachError):
    """A property names a state or an outcome that the machine does not have.

    Try: use the path of a state (`/M/DRIVE`) and an outcome that the machine has.
    """


@dataclass(frozen=True, slots=True)
class Property:
    """A property of every run.

    Attributes:
        kind: "never", "always_reaches", "before", "after_preempt" or "after_any_end".
        names: Paths or labels of states, or outcomes of the machine.
    """

    kind: str
    names: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(self.names)})"


def never(state: str) -> Property:
    """No run reaches `state` (a path, or the end of one)."""
    return Property("never", (state,))


def always_reaches(*outcomes: str) -> Property:
    """Every run without a preempt ends, with one of these outcomes of the machine.

    A loop with a way out counts as one that is left at some time.
    """
    return Property("always_reaches", outcomes)


def before(first: str, second: str) -> Property:
    """No run reaches state `second` before state `first` has ended."""
    return Property("before", (first, second))


def after_preempt(state: str) -> Property:
    """A run in which a state services a preempt passes through `state` before it ends."""
    return Property("after_preempt", (state,))


def after_any_end(state: str) -> Property:
    """A run in which the container of `state` begins passes through `state` before it ends."""
    return Property("after_any_end", (state,))


_KINDS = {
    "never": 1,
    "always_reaches": None,
    "before": 2,
    "after_preempt": 1,
    "after_any_end": 1,
}


def parse(text: str) -> Property:
    """Return the property in a text such as `before(/PATROL/UNDOCK, /PATROL/DRIVE)`.

    Raises:
        PropertyError: there is none.
    """
    match = re.fullmatch(r"\s*(\w+)\s*\((.*)\)\s*", text)
    kind = match[1] if match else text.strip()
    names = tuple(n.strip().strip("\"'") for n in match[2].split(",")) if match else ()
    if kind not in _KINDS or not all(names) or not names or _KINDS[kind] not in {None, len(names)}:
        raise PropertyError(
            f"property: got {text!r}; expected never(STATE), always_reaches(OUTCOME, ...), "
            f"before(STATE, STATE), after_preempt(STATE) or after_any_end(STATE)."
            f"{did_you_mean(kind, _KINDS)}"
        )
    return Property(kind, names)


def find(subject: Subject, graph: Graph, wanted: Iterable[Property]) -> Iterator[Problem]:
    """Yield a problem for each property that does not hold.

    Raises:
        PropertyError: one names something that does not exist.
    """
    meant: dict[str, list[str]] = {}  # the paths that each path, and each end of one, stands for
    for record in subject.root.walk():
        end = record.path
        while end:
            meant.setdefault(end, []).append(record.path)
            end = end.partition("/")[2]
    for each in wanted:
        problem = _find(subject, graph, each, meant)
        if problem is not None:
            yield problem


def _find(
    subject: Subject, graph: Graph, wanted: Property, meant: Mapping[str, list[str]]
) -> Problem | None:
    if wanted.kind == "always_reaches":
        found = _always_reaches(subject, graph, wanted.names)
    else:
        paths = [_resolve(subject, name, meant) for name in wanted.names]
        search: dict[str, Callable[..., Broken]] = {
            "never": _never,
            "before": _before,
            "after_preempt": _after_preempt,
            "after_any_end": _after_any_end,
        }
        found = search[wanted.kind](graph, *paths)
    if found is None:
        return None
    text = f"{wanted} does not hold: {found[0]}."
    return Problem("property", "error", subject.root.path, text, moments=moments(found[1]))


def _resolve(subject: Subject, name: str, meant: Mapping[str, list[str]]) -> str:
    """Return the path of the state that matches `name`."""
    if name.startswith("/") and name in meant:
        return name
    found = meant.get(name.strip("/"), [])
    if len(found) == 1:
        return found[0]
    paths = [record.path for record in subject.root.walk()]
    what = f"{len(found)} states: {found}" if found else "no state"
    near = did_you_mean(name, [*paths, *(p.rpartition("/")[2] for p in paths)])
    raise PropertyError(f"property: state {name!r} means {what}; expected one of {paths}.{near}")


def _never(graph: Graph, path: str) -> Broken:
    steps = graph.path([graph.start], graph.begins(path))
    return None if steps is None else (f"this run gets to {path}", steps)


def _always_reaches(subject: Subject, graph: Graph, names: tuple[str, ...]) -> Broken:
    unknown = [name for name in names if name not in subject.root.outcomes]
    if unknown:
        raise PropertyError(
            f"property: outcomes {unknown} of {subject.root.path}: expected some of "
            f"{list(subject.root.outcomes)}.{did_you_mean(unknown[0], subject.root.outcomes)}"
        )
    good = {number for outcome, number in graph.ends.items() if outcome in names}
    steps = graph.path([graph.start], {*graph.ends.values()} - good, preempt=False)
    if steps is not None:
        return f"this run ends with {steps[-1].outcome!r}", steps
    # Some reachable moment from which no good end can be reached: the run never ends.
    ends_well = graph.leading_to(good | graph.loose, preempt=False)
    for number in sorted(graph.reachable([graph.start], preempt=False)):
        if number not in ends_well:
            return "this run never ends", graph.path([graph.start], {number}, preempt=False) or []
    return None


def _before(graph: Graph, first: str, second: str) -> Broken:
    ended = {n.number for n in graph.nodes if n.record.path == first and n.outcome is not None}
    # With all ends of `first` removed, no way to `second` may be left.
    steps = graph.path([graph.start], graph.begins(second), avoid=ended)
    return None if steps is None else (f"this run gets to {second} without {first}", steps)


def _after_preempt(graph: Graph, path: str) -> Broken:
    ends, begins = set(graph.ends.values()), graph.begins(path)
    for number in sorted(graph.reachable([graph.start])):
        node = graph.nodes[number]
        inside = f"{node.record.path}/".startswith(f"{path}/")
        if node.outcome != PREEMPTED or node.record.is_container or inside:
            continue
        end = graph.path([number], ends, avoid=begins, framework=False)
        if end is not None:
            run = (graph.path([graph.start], {number}) or []) + end[1:]
            return f"{node.record.path} is preempted and the run ends without {path}", run
    return None


def _after_any_end(graph: Graph, path: str) -> Broken:
    begins, around = graph.begins(path), graph.begins(path.rpartition("/")[0])
    end = graph.path(around & graph.reachable([graph.start]), {*graph.ends.values()}, avoid=begins)
    if end is None:
        return None
    run = (graph.path([graph.start], {end[0].number}) or []) + end[1:]
    return f"this run ends without {path}", run
