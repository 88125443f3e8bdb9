"""Rules about states, outcomes, loops and concurrences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy.checks._core import graph as runs
from smachpy.checks._core.graph import PREEMPTED
from smachpy.checks._core.model import Problem
from smachpy.checks._core.rules import RULES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.checks._core.graph import Graph, Node
    from smachpy.checks._core.model import Subject
    from smachpy.introspection import StateRecord


def find(subject: Subject, graph: Graph) -> Iterator[Problem]:
    """Yield what is wrong with the structure."""
    reached = graph.reachable([graph.start])
    alive = {graph.nodes[number].record.path for number in reached}
    yield from _unreachable(subject, alive)
    for record in subject.root.walk():
        if record.path in alive:
            yield from _outcomes(subject, graph, reached, record)
            yield from _leaf(subject, record)
            if record.kind == "concurrence":
                yield from _concurrence(subject, record)
            if record.is_container:
                yield from _preempts(subject, record)
    yield from _loops(graph, reached)
    yield from _waits(subject, subject.root, limited=False)


def _problem(subject: Subject, rule: str, record: StateRecord, message: str, hint: str) -> Problem:
    place = subject.facts_of(record).place
    return Problem(rule, RULES[rule].severity, record.path, message, hint, place)


def _unreachable(subject: Subject, alive: set[str]) -> Iterator[Problem]:
    for record in subject.root.walk():
        for child in record.children:
            if child.path not in alive and record.path in alive:
                yield _problem(
                    subject,
                    "unreachable-state",
                    child,
                    f"no run gets to {child.path}.",
                    "Lead a transition to it, or remove it.",
                )


def _outcomes(
    subject: Subject, graph: Graph, reached: set[int], record: StateRecord
) -> Iterator[Problem]:
    """Outcomes that nothing can produce."""
    facts = subject.facts_of(record)
    made = {
        n.outcome for n in map(graph.nodes.__getitem__, reached) if n.record.path == record.path
    }
    if not record.is_container and facts.returns is None:
        return
    for outcome in record.outcomes:
        if outcome not in made | facts.made and outcome != PREEMPTED:
            who = "no child leads to it" if record.is_container else "its code never returns it"
            yield _problem(
                subject,
                "impossible-outcome",
                record,
                f"{record.path} declares outcome {outcome!r}, but {who}.",
                "Remove the outcome, or produce it.",
            )


def _leaf(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    facts = subject.facts_of(record)
    for outcome, place in facts.undeclared:
        yield Problem(
            "undeclared-outcome",
            "error",
            record.path,
            f"{record.path} returns {outcome!r}; its outcomes are {list(record.outcomes)}.",
            "Declare the outcome, or return another.",
            place,
        )
    state = "smachpy.current_state()" if facts.is_function else "self"
    for what, place in facts.loops:
        yield Problem(
            "deaf-loop",
            "warning",
            record.path,
            f"{record.path}: {what} waits without looking at the preempt.",
            f"Test {state}.preempt_requested() in the loop, or wait with {state}.sleep(...).",
            place,
        )


def _waits(subject: Subject, record: StateRecord, *, limited: bool) -> Iterator[Problem]:
    """Waits without a timeout, unless a container around them has one."""
    details = dict(record.details)
    limited = limited or (record.is_container and "timeout" in details)
    if not limited and "timeout" not in details:
        for what, place in subject.facts_of(record).waits:
            yield Problem(
                "no-timeout",
                "warning",
                record.path,
                f"{record.path}: {what} has no timeout.",
                "Give it a timeout, or give one to the state or a container around it.",
                place,
            )
    for child in record.children:
        yield from _waits(subject, child, limited=limited)


def _loops(graph: Graph, reached: set[int]) -> Iterator[Problem]:
    """Moments that nothing but a preempt from outside can lead out of."""
    can_end = {*graph.ends.values(), *graph.loose}
    before: dict[int, list[int]] = {}
    for number in reached:
        for after in graph.after(number, framework=False):
            before.setdefault(after, []).append(number)
    queue = list(can_end)
    while queue:
        for number in before.get(queue.pop(), ()):
            if number not in can_end:
                can_end.add(number)
                queue.append(number)
    stuck = [graph.nodes[n] for n in sorted(reached) if n not in can_end]
    yield from _endless(graph, stuck)


def _endless(graph: Graph, stuck: list[Node]) -> Iterator[Problem]:
    seen: set[str] = set()
    for node in stuck:
        parent = node.record.path.rpartition("/")[0]
        loop = graph.reachable(graph.after(node.number, preempt=False), preempt=False)
        if node.number not in loop or parent in seen or node.outcome is not None:
            continue
        members = {graph.nodes[n].record for n in loop if graph.nodes[n].outcome is None}
        labels = sorted({r.label for r in members if r.path.rpartition("/")[0] == parent})
        if node.record.label not in labels:
            continue
        seen.add(parent)
        steps = graph.path([graph.start], {node.number}) or []
        yield Problem(
            "endless-loop",
            "error",
            parent,
            f"{parent}: {', '.join(labels)} lead only to each other; no outcome ends the loop.",
            "Lead a transition out of it.",
            None,
            runs.moments(steps),
        )


def _concurrence(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    facts = subject.facts_of(record)
    # A callback may decide before the rules are asked.
    combined = [] if facts.any_outcome else runs.combinations(record, subject) or []
    told: set[frozenset[str]] = set()
    for outcomes in combined:
        holding = [rule for rule in facts.outcome_rules if rule.holds(outcomes)]
        most = max((rule.need for rule in holding), default=0)
        rivals = frozenset(rule.outcome for rule in holding if rule.need == most)
        if len(rivals) > 1 and rivals not in told:
            told.add(rivals)
            said = ", ".join(f"{label}:{outcome}" for label, outcome in outcomes.items())
            yield _problem(
                subject,
                "ambiguous-map",
                record,
                f"{record.path}: with {said} the rules for {sorted(rivals)} hold equally; the "
                "last one wins.",
                "Make one of them ask for more.",
            )
    if not facts.cuts:
        yield from _never_ending(subject, record)


def _never_ending(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    for child in record.children:
        if child.is_container:
            continue
        ends = runs.possible(child, subject.facts_of(child))
        if subject.facts_of(child).returns is not None and set(ends) <= {PREEMPTED}:
            yield _problem(
                subject,
                "stuck-concurrence",
                record,
                f"{record.path} waits for {child.label}, which ends only when it is preempted, and "
                "nobody preempts it.",
                "Give the concurrence a child_termination_cb, or the child another way to end.",
            )


def _preempts(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    """A preempt that the container passes on to the one around it as something else."""
    if record.path == subject.root.path:
        return  # nothing is around it that could go on
    for child, outcome in _preempt_ends(subject, record):
        if outcome != PREEMPTED:
            yield _problem(
                subject,
                "preempt-outcome",
                record,
                f"{record.path}: a preempt of {child} leaves it by {outcome!r}, so what is around "
                "it goes on as if there had been none.",
                "Lead it to the outcome 'preempted'.",
            )


def _preempt_ends(subject: Subject, record: StateRecord) -> Iterator[tuple[str, str]]:
    """Yield (child, container outcome) for what children that were preempted lead to."""
    if record.kind == "concurrence":
        if not subject.facts_of(record).any_outcome:
            outcome = _all_preempted(subject, record)
            if outcome is not None:
                yield "all its children", outcome
        return
    edges = {(e.source, e.outcome): e for e in record.transitions}
    for child in record.children:
        if PREEMPTED not in child.outcomes:
            continue
        edge = edges.get((child.label, PREEMPTED))
        seen = {child.label}
        ends: set[str] = set()
        queue = [edge] if edge is not None else []
        while queue:
            at = queue.pop()
            if at.target_is_outcome:
                ends.add(at.target)
            elif at.target not in seen and record.kind != "iterator":
                seen.add(at.target)
                queue += [e for e in record.transitions if e.source == at.target]
        if ends and PREEMPTED not in ends:
            yield child.label, min(ends)


def _all_preempted(subject: Subject, record: StateRecord) -> str | None:
    facts = subject.facts_of(record)
    preempted = {child.label: PREEMPTED for child in record.children}
    if not all(PREEMPTED in child.outcomes for child in record.children):
        return None
    ruled = runs.decide(facts, preempted)
    if ruled is not None:
        return ruled
    return PREEMPTED if PREEMPTED in record.outcomes else record.default_outcome
