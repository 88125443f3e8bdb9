"""All runs of a machine as one directed graph.

A node is a moment: a state begins, or it has ended with an outcome. The children of a concurrence
run at once; the graph has them in sequence, once for each outcome of the concurrence with the child
outcomes that lead to it, and once more each child alone, as the first to run. Edges that only a
preempt takes are marked.
"""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from smachpy.checks.model import Facts, Moments, Subject
    from smachpy.events.introspection import StateRecord

PREEMPTED = "preempted"
MAX_COMBINATIONS = 5_000  # of child outcomes; a larger concurrence may end with any outcome
MAX_NODES = 200_000  # a larger machine is refused: its parts can be checked one by one


@dataclass(frozen=True, slots=True)
class GraphNode:
    """A moment of a run.

    Attributes:
        number: Its number in the graph.
        record: The state.
        outcome: The outcome with which it has just ended; None: it begins.
    """

    number: int
    record: StateRecord
    outcome: str | None


@dataclass(slots=True)
class _GraphPiece:
    """A state in the graph: the node where it begins, and the nodes where it ends, by outcome."""

    enter: GraphNode
    ends: dict[str, GraphNode]


@dataclass(slots=True)
class Graph:
    """Moments and their possible successors.

    Attributes:
        nodes: The moments.
        edges: The successors of each.
        only_preempt: Edges that only a preempt takes.
        by_framework: Edges on which a container itself ends because of a preempt.
        loose: Ends of children that are in the graph alone; they have no successors.
        start: The beginning of the root.
        ends: The root's outcomes.
    """

    nodes: list[GraphNode] = field(default_factory=list)
    edges: list[list[int]] = field(default_factory=list)
    only_preempt: set[tuple[int, int]] = field(default_factory=set)
    by_framework: set[tuple[int, int]] = field(default_factory=set)
    loose: set[int] = field(default_factory=set)
    start: int = 0
    ends: dict[str, int] = field(default_factory=dict)
    _begins: dict[str, set[int]] = field(default_factory=dict)  # by path
    # Each moment that a run can come to -> its place in a search from the start, and the one before
    # it; empty until it is needed. Nothing is added to the graph after that.
    _came: dict[int, tuple[int, int | None]] = field(default_factory=dict)

    def add(self, record: StateRecord, outcome: str | None) -> GraphNode:
        """Add a moment, without successors."""
        node = GraphNode(len(self.nodes), record, outcome)
        self.nodes.append(node)
        self.edges.append([])
        if outcome is None:
            self._begins.setdefault(record.path, set()).add(node.number)
        return node

    def begins(self, path: str) -> set[int]:
        """Return the moments at which the state at `path` begins."""
        return set(self._begins.get(path, ()))

    def after(self, number: int, *, preempt: bool = True, framework: bool = True) -> Iterator[int]:
        """Yield the possible successors of a moment.

        Args:
            number: The moment.
            preempt: Whether a preempt may be requested.
            framework: Whether a container may end by itself because of it.
        """
        for after in self.edges[number]:
            pair = (number, after)
            if (preempt or pair not in self.only_preempt) and (
                framework or pair not in self.by_framework
            ):
                yield after

    def reachable(self, start: Iterable[int], *, preempt: bool = True) -> set[int]:
        """Return `start` and all moments that can follow."""
        seen = set(start)
        queue = list(seen)
        while queue:
            new = set(self.after(queue.pop(), preempt=preempt)) - seen
            seen |= new
            queue += new
        return seen

    def leading_to(self, goals: Iterable[int], *, preempt: bool = True) -> set[int]:
        """Return `goals` and all moments that they can follow."""
        before: dict[int, list[int]] = {}
        for number in range(len(self.nodes)):
            for after in self.after(number, preempt=preempt):
                before.setdefault(after, []).append(number)
        seen = set(goals)
        queue = list(seen)
        while queue:
            new = {number for number in before.get(queue.pop(), ()) if number not in seen}
            seen |= new
            queue += new
        return seen

    def path(
        self,
        start: Iterable[int],
        goals: Collection[int],
        *,
        avoid: Collection[int] = (),
        preempt: bool = True,
        framework: bool = True,
    ) -> list[GraphNode] | None:
        """Return a shortest run from `start` to one of `goals` that avoids all of `avoid`."""
        if [*start] == [self.start] and not avoid and preempt and framework:
            return self._path_from_start(goals)
        came: dict[int, int | None] = {number: None for number in start if number not in avoid}
        queue = deque(came)
        while queue:
            number = queue.popleft()
            if number in goals:
                steps = [number]
                while (before := came[steps[-1]]) is not None:
                    steps.append(before)
                return [self.nodes[step] for step in reversed(steps)]
            for after in self.after(number, preempt=preempt, framework=framework):
                if after not in came and after not in avoid:
                    came[after] = number
                    queue.append(after)
        return None

    def _path_from_start(self, goals: Collection[int]) -> list[GraphNode] | None:
        """Return the same for any run: one search finds those for all problems of a check."""
        if not self._came:
            self._came = {self.start: (0, None)}
            queue = deque(self._came)
            while queue:
                for after in self.after(number := queue.popleft()):
                    if after not in self._came:
                        self._came[after] = (len(self._came), number)
                        queue.append(after)
        reached = [number for number in goals if number in self._came]
        if not reached:
            return None
        steps = [min(reached, key=self._came.__getitem__)]
        while (before := self._came[steps[-1]][1]) is not None:
            steps.append(before)
        return [self.nodes[step] for step in reversed(steps)]

    def closed_loops(self, among: Collection[int]) -> Iterator[set[int]]:
        """Yield each set of moments that only lead to each other.

        Args:
            among: Moments; all their successors must be in it, except for ends that a container
                takes by itself because of a preempt.
        """
        after = {number: [*self.after(number, framework=False)] for number in sorted(among)}
        before: dict[int, list[int]] = {number: [] for number in after}
        for number, followers in after.items():
            for follower in followers:
                before[follower].append(number)
        # Kosaraju's algorithm on the reversed graph: a depth-first search along reversed edges
        # finishes last with a moment of a component without outgoing edges. Searches along the
        # edges in that order find one component after another. Written without recursion: graphs
        # are deep.
        order: list[int] = []
        seen: set[int] = set()
        for start in after:
            stack = [] if start in seen else [(start, iter(before[start]))]
            seen.add(start)
            while stack:
                number, rest = stack[-1]
                new = next((n for n in rest if n not in seen), None)
                if new is None:
                    order.append(number)
                    stack.pop()
                else:
                    seen.add(new)
                    stack.append((new, iter(before[new])))
        taken: set[int] = set()
        for start in reversed(order):
            if start in taken:
                continue
            queue, loop, closed = [start], {start}, True
            while queue:
                followers = after[queue.pop()]
                closed = closed and taken.isdisjoint(followers)
                found = {one for one in followers if one not in taken and one not in loop}
                loop |= found
                queue += found
            taken |= loop
            if closed and (len(loop) > 1 or start in after[start]):
                yield loop


def build(subject: Subject) -> Graph:
    """Return the graph of a machine.

    Raises:
        RecursionError: the machine has too many moments.
    """
    builder = _Builder(subject)
    root = builder.state(subject.root)
    graph = builder.graph
    graph.start = root.enter.number
    graph.ends = {outcome: node.number for outcome, node in root.ends.items()}
    return graph


def possible(record: StateRecord, facts: Facts) -> list[str]:
    """Return the possible outcomes of a leaf."""
    if facts.returns is None:
        return list(record.outcomes)
    made = facts.returns | facts.made | {PREEMPTED}
    return [outcome for outcome in record.outcomes if outcome in made]


class _Builder:
    """Adds the states of a machine to a graph."""

    def __init__(self, subject: Subject) -> None:
        self._subject = subject
        self.graph = Graph()

    def state(self, record: StateRecord) -> _GraphPiece:
        if len(self.graph.nodes) > MAX_NODES:
            raise RecursionError(
                f"{record.path}: the machine has more than {MAX_NODES} moments; expected fewer. "
                "Try checking its parts."
            )
        enter = self.graph.add(record, None)
        if not record.is_container:
            outcomes = possible(record, self._subject.facts_of(record))
            part = _GraphPiece(enter, {o: self.graph.add(record, o) for o in outcomes})
            for outcome, node in part.ends.items():
                self._edge(enter, node, preempt=outcome == PREEMPTED)
            return part
        part = _GraphPiece(enter, {o: self.graph.add(record, o) for o in record.outcomes})
        if record.cleanup:
            others, at_ends = self._before_cleanup(record, part)
            self._children(others, at_ends)
        else:
            self._children(record, part)
        return part

    def _before_cleanup(
        self, record: StateRecord, part: _GraphPiece
    ) -> tuple[StateRecord, _GraphPiece]:
        """Lead a copy of the clean-up to each end of a container.

        Returns:
            The container without its clean-up, and the beginnings of the copies as its ends.
        """
        (cleanup,) = (child for child in record.children if child.label == record.cleanup)
        begins: dict[str, GraphNode] = {}
        for outcome, end in part.ends.items():
            copy = self.state(cleanup)
            begins[outcome] = copy.enter
            for node in copy.ends.values():
                self._edge(node, end)
        return replace(record, children=record.others), _GraphPiece(part.enter, begins)

    def _children(self, record: StateRecord, part: _GraphPiece) -> None:
        """Add the children of a container."""
        for outcome in self._subject.facts_of(record).made & set(part.ends):
            self._edge(part.enter, part.ends[outcome])
        add = {
            "concurrence": self._concurrence,
            "iterator": self._iterator,
            "plan": self._plan,
        }
        add.get(record.kind, self._machine)(record, part)

    def _machine(self, record: StateRecord, part: _GraphPiece) -> None:
        children = {child.label: self.state(child) for child in record.children}
        for label in record.initial:
            self._edge(part.enter, children[label].enter)
        for edge in record.transitions:
            source = children[edge.source].ends.get(edge.outcome)
            child = children[edge.source]
            if edge.outcome not in child.enter.record.outcomes:  # an event, at any moment
                for node in (child.enter, *child.ends.values()):
                    self._edge(node, children[edge.target].enter)
            if source is None:
                continue
            if not edge.target_is_outcome and edge.target in children:
                self._edge(source, children[edge.target].enter)
            elif edge.target in part.ends:
                self._edge(source, part.ends[edge.target])
        for child in children.values():
            self._preempted(part, child)

    def _preempted(self, part: _GraphPiece, child: _GraphPiece) -> None:
        """Add the ends after a preempt before or after a child, if the container declares them."""
        if PREEMPTED in part.ends:
            for node in (child.enter, *child.ends.values()):
                self._edge(node, part.ends[PREEMPTED], preempt=True, framework=True)

    def _iterator(self, record: StateRecord, part: _GraphPiece) -> None:
        exhausted = [part.ends[r.outcome] for r in record.rules if r.outcome in part.ends]
        facts = self._subject.facts_of(record)
        for child_record in record.children:
            child = self.state(child_record)
            if not facts.empty:
                self._edge(part.enter, child.enter)
            for edge in record.transitions:
                source = child.ends.get(edge.outcome)
                if source is None:
                    continue
                targets = [part.ends[edge.target]] if edge.target in part.ends else []
                if not edge.target_is_outcome:
                    targets = [child.enter, *exhausted]
                for target in targets:
                    self._edge(source, target)
            self._preempted(part, child)
        if facts.empty or not record.children:
            for node in exhausted:
                self._edge(part.enter, node)

    def _plan(self, record: StateRecord, part: _GraphPiece) -> None:
        """Add the actions of a plan, in any order: the possible orders are checked on its net."""
        for child_record in record.children:
            child = self.state(child_record)
            self._edge(part.enter, child.enter)
            for node in child.ends.values():
                self._edge(node, part.enter)
            self._preempted(part, child)
        for outcome, node in part.ends.items():
            preempt = outcome == PREEMPTED
            self._edge(part.enter, node, preempt=preempt, framework=preempt)

    def _concurrence(self, record: StateRecord, part: _GraphPiece) -> None:
        for child_record in record.children:  # each one alone, before the others have done anything
            alone = self.state(child_record)
            self._edge(part.enter, alone.enter)
            self.graph.loose |= {node.number for node in alone.ends.values()}
        for outcome, allowed in outcomes_of(record, self._subject).items():
            if outcome not in part.ends:
                continue
            at: list[GraphNode] = [part.enter]
            for child_record in record.children:
                child = self.state(child_record)
                for node in at:
                    self._edge(node, child.enter)
                at = [child.ends[o] for o in allowed[child_record.label] if o in child.ends]
                if self._subject.facts_of(record).cuts and PREEMPTED in child.ends:
                    self._edge(child.enter, child.ends[PREEMPTED])
            for node in at:
                self._edge(node, part.ends[outcome])
        if PREEMPTED in part.ends:
            self._edge(part.enter, part.ends[PREEMPTED], preempt=True, framework=True)

    def _edge(
        self,
        source: GraphNode,
        target: GraphNode,
        *,
        preempt: bool = False,
        framework: bool = False,
    ) -> None:
        pair = (source.number, target.number)
        graph = self.graph
        new = target.number not in graph.edges[source.number]
        if new:
            graph.edges[source.number].append(target.number)
        for marked, marks in ((preempt, graph.only_preempt), (framework, graph.by_framework)):
            # An edge stays marked only if each of its reasons is marked: one ordinary transition
            # makes it an ordinary edge.
            if marked and new:
                marks.add(pair)
            elif not marked:
                marks.discard(pair)


def combinations(record: StateRecord, subject: Subject) -> list[dict[str, str]] | None:
    """Return all combinations of the outcomes of a concurrence's children; None if too many."""
    choices = [
        possible(child, subject.facts_of(child)) if not child.is_container else child.outcomes
        for child in record.others
    ]
    count = 1
    for choice in choices:
        count *= max(1, len(choice))
    if count > MAX_COMBINATIONS:
        return None
    labels = [child.label for child in record.others]
    return [dict(zip(labels, chosen, strict=True)) for chosen in itertools.product(*choices)]


def decide(facts: Facts, outcomes: Mapping[str, str]) -> str | None:
    """Return the outcome by the rules: of those that hold, the last of the most demanding."""
    best, most = None, -1
    for rule in facts.outcome_rules:
        if rule.need >= most and rule.holds(outcomes):
            best, most = rule.outcome, rule.need
    return best


def outcomes_of(record: StateRecord, subject: Subject) -> dict[str, dict[str, set[str]]]:
    """Return each outcome of a concurrence, with the child outcomes that can go with it."""
    facts = subject.facts_of(record)
    anything = {child.label: set(child.outcomes) for child in record.others}
    combined = combinations(record, subject)
    if facts.any_outcome or combined is None:
        return {o: {k: set(v) for k, v in anything.items()} for o in record.outcomes}
    found: dict[str, dict[str, set[str]]] = {}
    for outcomes in combined:
        outcome = decide(facts, outcomes) or record.default_outcome
        if outcome is not None:
            allowed = found.setdefault(outcome, {label: set() for label in anything})
            for label, child_outcome in outcomes.items():
                allowed[label].add(child_outcome)
    return found


def moments(steps: Iterable[GraphNode]) -> Moments:
    """Return a run as pairs (path, outcome); the outcome is None where the state begins."""
    return tuple((node.record.path, node.outcome) for node in steps)
