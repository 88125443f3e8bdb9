"""Two versions of a machine, or two sets of its runs, in one drawing.

The union has the states and transitions of both, each marked as added, removed, changed or "", the
same. A state is identified by the labels below the root: the roots may have different names.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from smachpy_viz.model.extract import extract
from smachpy_viz.model.machine import Diagram
from smachpy_viz.runs.statistics import MIN_DURATION_S, SLOWER, moved_states

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.model.machine import Edge, Node, RulePicture
    from smachpy_viz.runs.statistics import Statistics

ADDED, REMOVED, CHANGED, SAME = "added", "removed", "changed", ""

LISTED = 4
"""Items of a list that are named in a difference."""


@dataclass(frozen=True, slots=True)
class ComparedRun:
    """One side of a comparison.

    Attributes:
        name: Its name in texts, such as a file or a machine.
        record: The machine.
        statistics: Statistics of its runs; None to compare only the structure.
    """

    name: str
    record: StateRecord
    statistics: Statistics | None = None


@dataclass(slots=True)
class MergedMachine:
    """The states and transitions of both sides, with the paths of the second.

    Attributes:
        record: The machine with the states and transitions of both.
        states: Change of each state that differs, by path.
        arrows: Change of each transition and rule, by (path of the state, outcome, target).
        reasons: Descriptions of what changed in a state, by path.
        notes: Descriptions of differing statistics, by path.
        counts: The same for transitions, by (path of the state, outcome).
    """

    record: StateRecord
    states: dict[str, str] = field(default_factory=dict)
    arrows: dict[tuple[str, str, str], str] = field(default_factory=dict)
    reasons: dict[str, list[str]] = field(default_factory=dict)
    notes: dict[str, str] = field(default_factory=dict)
    counts: dict[tuple[str, str], str] = field(default_factory=dict)

    def node(self, *, depth: int | None = None, show_implicit: bool = False) -> Node:
        """Return the diagram with the changes marked."""
        return self._marked(extract(self.record, depth=depth, show_implicit=show_implicit))

    def listed(self) -> list[dict[str, str]]:
        """Return the differences in the order of the states, each as path, change and text."""
        found = []
        for state in self.record.walk():
            change = self.states.get(state.path, SAME)
            words = "; ".join(self.reasons.get(state.path, ()))
            if change:
                found.append({"path": state.path, "change": change, "text": words or change})
            # An added or removed state says enough: its transitions are not listed as well.
            for (path, outcome, target), how in self.arrows.items():
                if path == state.path and how and change not in {ADDED, REMOVED}:
                    text = f"{outcome} \u2192 {target}"
                    found.append({"path": path, "change": how, "text": text})
            if note := self.notes.get(state.path):
                found.append({"path": state.path, "change": "numbers", "text": note})
        return found

    def _marked(self, node: Node) -> Node:
        return replace(
            node,
            change=self.states.get(node.path, SAME),
            note=self.notes.get(node.path, ""),
            details=(*node.details, *(("compared", r) for r in self.reasons.get(node.path, ()))),
            children=tuple(self._marked(child) for child in node.children),
            edges=tuple(part for edge in node.edges for part in self._parts(node.path, edge)),
            rules=tuple(replace(r, change=self._rule(node.path, r)) for r in node.rules),
        )

    def _parts(self, container: str, edge: Edge) -> Iterator[Edge]:
        """Split an edge of several outcomes into one per kind of change."""
        path = f"{container}/{edge.source}"
        # An edge carries all outcomes that lead from one state to the same target.
        by: dict[tuple[str, str], list[str]] = {}
        for outcome in edge.outcomes:
            change = self.arrows.get((path, outcome, edge.target), SAME)
            by.setdefault((change, self.counts.get((path, outcome), "")), []).append(outcome)
        for (change, note), outcomes in by.items():
            yield replace(edge, outcomes=tuple(outcomes), change=change, note=note)

    def _rule(self, container: str, rule: RulePicture) -> str:
        changes = {
            self.arrows.get((f"{container}/{label}", outcome, rule.outcome), SAME)
            for label, outcome in rule.conditions
        }
        # Marked only if all of its conditions are; its single arrows have marks of their own.
        return changes.pop() if len(changes) == 1 else SAME


def unite(old: ComparedRun, new: ComparedRun) -> MergedMachine:
    """Return the union of both, with the paths of `new`."""
    union = MergedMachine(new.record)
    union.record = _merged(union, old.record, new.record, new.record.path)
    # A moved state is drawn twice, as removed and as added; the reasons link the two.
    for before, after in moved_states(old.record, new.record):
        here, there = new.record.path + before, new.record.path + after
        union.reasons.setdefault(here, []).append(f"moved to {there}")
        union.reasons.setdefault(there, []).append(f"moved from {here}")
    if old.statistics is not None and new.statistics is not None:
        _compare_numbers(union, old, old.statistics, new.statistics)
    return union


def _merged(
    union: MergedMachine, old: StateRecord | None, new: StateRecord | None, path: str
) -> StateRecord:
    """Merge a state of one side or both with all descendants; record the changes in `union`."""
    # First the arrows inside this container, then its children, then the state itself.
    before, after = set(_triples(old)), set(_triples(new))
    for change, triples in ((ADDED, after - before), (REMOVED, before - after)):
        for source, outcome, target in sorted(triples):
            union.arrows[f"{path}/{source}", outcome, target] = change
    olds = {child.label: child for child in old.children} if old else {}
    news = {child.label: child for child in new.children} if new else {}
    labels = _ordered(list(olds), list(news))
    children = tuple(
        _merged(union, olds.get(label), news.get(label), f"{path}/{label}") for label in labels
    )
    if old is None or new is None:
        one, union.states[path] = (new, ADDED) if old is None else (old, REMOVED)
        assert one is not None
        return replace(one, path=path, children=children)
    # In both: the new state, to which what only the old one had is added so that it is drawn.
    if reasons := list(_reasons(old, new)):
        union.states[path], union.reasons[path] = CHANGED, reasons
    gone = [t for t in old.transitions if (t.source, t.outcome, t.target) in before - after]
    return replace(
        new,
        path=path,
        outcomes=tuple(dict.fromkeys((*new.outcomes, *old.outcomes))),
        children=children,
        transitions=(*new.transitions, *gone),
        rules=(*new.rules, *(rule for rule in old.rules if rule not in new.rules)),
    )


def _triples(record: StateRecord | None) -> Iterator[tuple[str, str, str]]:
    """The transitions and rules inside a container as (label, outcome, target)."""
    if record is None:
        return
    for edge in record.transitions:
        yield edge.source, edge.outcome, edge.target
    for rule in record.rules:
        for label, outcome in rule.conditions:
            yield label, outcome, rule.outcome


def _ordered(old: list[str], new: list[str]) -> list[str]:
    """The labels of both, in the order of `new`; each removed one after its old predecessor."""
    found = list(new)
    for i, label in enumerate(old):
        if label not in found:
            before = [other for other in old[:i] if other in found]
            found.insert(found.index(before[-1]) + 1 if before else 0, label)
    return found


def _reasons(old: StateRecord, new: StateRecord) -> Iterator[str]:
    # As sets where the order has no meaning: a reordering is no change.
    pairs: dict[str, tuple[Any, Any]] = {
        "kind": (old.kind, new.kind),
        "class": (old.type_name, new.type_name),
        "begins at": (old.initial, new.initial),
        "outcomes": (set(old.outcomes), set(new.outcomes)),
        "reads": (set(old.input_keys), set(new.input_keys)),
        "writes": (set(old.output_keys), set(new.output_keys)),
        "remapping": (set(old.remapping), set(new.remapping)),
        "default outcome": (old.default_outcome, new.default_outcome),
    }
    details = dict(old.details), dict(new.details)
    for name in dict.fromkeys((*details[0], *details[1])):
        pairs[name] = details[0].get(name), details[1].get(name)
    for name, (before, after) in pairs.items():
        if before != after:
            yield f"{name}: {_words(before)} \u2192 {_words(after)}"


def _words(value: Any) -> str:
    if not value:
        return "none"
    if isinstance(value, str):
        return value
    items = sorted(value) if isinstance(value, set) else value
    shown = [" = ".join(item) if isinstance(item, tuple) else str(item) for item in items]
    return ", ".join(shown[:LISTED]) + (", \u2026" if len(shown) > LISTED else "")


def _compare_numbers(
    union: MergedMachine, old: ComparedRun, before: Statistics, after: Statistics
) -> None:
    # Everything is compared per run, as the sides may have different numbers of runs.
    runs = max(before.runs, 1), max(after.runs, 1)
    for state in union.record.walk():
        # Paths of the union begin with the new root, which may have another name.
        old_path = old.record.path + state.path.removeprefix(union.record.path)
        pair = before.states.get(old_path), after.states.get(state.path)
        first, second = ({} if one is None else one.to_json() for one in pair)
        if words := list(_number_words(first, second, runs)):
            union.notes[state.path] = ", ".join(words)
        taken = first.get("outcomes", {}), second.get("outcomes", {})
        for outcome in dict.fromkeys((*taken[0], *taken[1])):
            shares = [side.get(outcome, 0) / n for side, n in zip(taken, runs, strict=True)]
            if shares[0] != shares[1]:
                union.counts[state.path, outcome] = _times(*shares)


def _number_words(
    old: Mapping[str, Any], new: Mapping[str, Any], runs: tuple[int, int]
) -> Iterator[str]:
    """Describe visits per run, medians and failures where they differ notably."""
    visits = old.get("visits", 0) / runs[0], new.get("visits", 0) / runs[1]
    if visits[0] != visits[1]:
        yield _times(*visits)
    before, after = old.get("median"), new.get("median")
    if before is not None and after is not None:
        # Both limits: a factor alone would report noise of short states, a difference alone that
        # of long ones.
        low, high = sorted((before, after))
        if high - low > MIN_DURATION_S and high > SLOWER * low:
            yield f"{before:.3g} s \u2192 {after:.3g} s"
    failures = old.get("failures", 0.0), new.get("failures", 0.0)
    if round(failures[0], 2) != round(failures[1], 2):
        yield f"{failures[0]:.0%} \u2192 {failures[1]:.0%} failed"


def _times(old: float, new: float) -> str:
    return f"\u00d7{old:.3g} \u2192 \u00d7{new:.3g}"


def drawing(
    union: MergedMachine, old: ComparedRun, new: ComparedRun, *, depth: int | None = None
) -> Diagram:
    """Return the diagram of a union, with a legend."""
    legend = [("", f"{old.name} \u2192 {new.name}:")]
    legend += [(change, change) for change in (ADDED, REMOVED, CHANGED)]
    if old.statistics is not None and new.statistics is not None:
        runs = f"{old.statistics.runs} and {new.statistics.runs}"
        legend.append(("", f"\u00d7: visits per run, of {runs} runs"))
    return Diagram(union.node(depth=depth), legend=tuple(legend), compared=True)
