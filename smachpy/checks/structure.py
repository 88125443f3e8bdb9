"""Rules about states, outcomes, loops and concurrences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actionlib_core.inputs.expression import Expression, ExpressionError
from smachpy.checks import graph as runs
from smachpy.checks.graph import PREEMPTED
from smachpy.checks.model import Problem
from smachpy.events.outcome_classes import outcome_class
from smachpy.events.run_state import paths_above

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from smachpy.checks.graph import Graph
    from smachpy.checks.model import Severity, Subject
    from smachpy.events.introspection import StateRecord


def find(subject: Subject, graph: Graph) -> Iterator[Problem]:
    """Yield the problems of the structure."""
    reached = graph.reachable([graph.start])
    known = {record.path: record for record in subject.root.walk()}
    made: dict[str, set[str | None]] = {}  # path of a reached state -> its outcomes there
    for node in map(graph.nodes.__getitem__, reached):
        made.setdefault(node.record.path, set()).add(node.outcome)
    for record in known.values():
        if record.path not in made:
            continue
        for child in record.children:
            if child.path not in made:
                text = f"no run gets to {child.path}."
                hint = "Lead a transition to it, or remove it."
                yield subject.problem("unreachable-state", child, text, hint)
        yield from _outcomes(subject, record, made[record.path])
        yield from _leaf(subject, record)
        yield from _cases(subject, record)
        if record.kind == "machine":  # in a sequence, the order says where it leads
            yield from _targets(subject, record)
        if record.kind == "concurrence":
            yield from _concurrence(subject, known, record)
        if record.is_container and record is not subject.root:  # after the root, nothing can go on
            yield from _preempts(subject, record)
    yield from _loops(subject, known, graph, reached)
    yield from _waits(subject, subject.root, limited=False)
    yield from _resources(subject)


def _outcomes(subject: Subject, record: StateRecord, made: set[str | None]) -> Iterator[Problem]:
    """Yield the outcomes that nothing can produce."""
    facts = subject.facts_of(record)
    if not record.is_container and facts.returns is None:
        return
    who = "no child leads to it" if record.is_container else "its code never returns it"
    for outcome in record.outcomes:
        if outcome not in made | facts.made and outcome != PREEMPTED:
            text = f"{record.path} declares outcome {outcome!r}, but {who}."
            hint = "Remove the outcome, or produce it."
            yield subject.problem("impossible-outcome", record, text, hint)


def _targets(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    """Yield the states with the name of an outcome, if a transition leads to that name."""
    for label in sorted(
        {t.target for t in record.transitions if not t.target_is_outcome} & {*record.outcomes}
    ):
        text = (
            f"{record.path} has a state and an outcome {label!r}: transitions to it lead to the "
            "state."
        )
        hint = "Give the state another label."
        yield subject.problem("ambiguous-target", record, text, hint)


def _leaf(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    facts = subject.facts_of(record)
    for outcome, place in facts.undeclared:
        text = f"{record.path} returns {outcome!r}; its outcomes are {list(record.outcomes)}."
        hint = "Declare the outcome, or return another."
        yield subject.problem("undeclared-outcome", record, text, hint, place=place)
    for key, place in facts.changes:
        if key in record.input_keys and key not in record.output_keys:
            text = (
                f"{record.path} changes the value of userdata key {key!r}, which it may only read."
            )
            hint = "Declare the key with io_keys, or change a copy."
            yield subject.problem("changed-input", record, text, hint, place=place)
    hint = "Pass it in as userdata or as an argument, or call it by smachpy.once."
    for what, place in facts.outside:
        text = f"{record.path} uses {what}, which no recording has: it cannot be reproduced."
        yield subject.problem("outside", record, text, hint, place=place)
    state = "smachpy.current_state()" if facts.is_function else "self"
    hint = f"Test {state}.preempt_requested() in the loop, or wait with {state}.sleep(...)."
    for what, place in facts.loops:
        text = f"{record.path}: {what} waits without looking at the preempt."
        yield subject.problem("deaf-loop", record, text, hint, place=place)


def _cases(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    """Yield the conditions that never hold, always hold, or come too late to decide anything."""
    before: dict[tuple[str, str], list[str]] = {}
    for edge in record.transitions:
        known = before.setdefault((edge.source, edge.outcome), [])
        where = f"{record.path}/{edge.source} -{edge.outcome}->"
        if "" in known:
            text = f"{where} {edge.target} is never taken, as a condition before it always holds."
        elif edge.guard and edge.guard in known:
            text = f"{where} {edge.target} is never taken: {edge.guard!r} is asked before."
        elif _constant(edge.guard) is False:
            text = f"{where} {edge.target} is never taken: {edge.guard!r} never holds."
        else:
            known.append("" if _constant(edge.guard) else edge.guard)
            continue
        (child,) = (child for child in record.children if child.label == edge.source)
        yield subject.problem("dead-case", child, text, "Correct the condition, or remove it.")


def _constant(guard: str) -> bool | None:
    """Return the value of a condition that asks for nothing; None for any other."""
    if not guard:
        return None
    try:
        expression = Expression(guard)
        return None if expression.names else bool(expression({}))
    except ExpressionError:  # the name of a function
        return None


def _waits(subject: Subject, record: StateRecord, *, limited: bool) -> Iterator[Problem]:
    """Yield the waits without a timeout, unless a container around them has one."""
    details = dict(record.details)
    limited = limited or (record.is_container and "timeout" in details)
    if not limited and "timeout" not in details:
        for what, place in subject.facts_of(record).waits:
            text = f"{record.path}: {what} has no timeout."
            hint = "Give it a timeout, or give one to the state or a container around it."
            yield subject.problem("no-timeout", record, text, hint, place=place)
    for child in record.children:
        yield from _waits(subject, child, limited=limited)


def _resources(subject: Subject) -> Iterator[Problem]:
    """Yield the states that take resources in another order than others: they can block forever."""
    inside: dict[str, dict[str, str]] = {}  # resource -> resource taken inside -> path of who does
    todo: list[tuple[StateRecord, tuple[str, ...]]] = [(subject.root, ())]
    while todo:
        record, held = todo.pop(0)
        name = dict(record.details).get("resource", "").partition(",")[0].lstrip("/")
        if name and name not in held:
            for outer in held:
                way = _way(inside, name, outer)
                if way:
                    text = (
                        f"{record.path} takes {name} inside of {outer}, and {way[0]} takes "
                        f"{' and then '.join(way[1:])} inside of {name}: each can wait for the "
                        "other."
                    )
                    hint = "Take them in the same order, or both at once in one machine around."
                    yield subject.problem("resource-order", record, text, hint)
                inside.setdefault(outer, {}).setdefault(name, record.path)
            held = (*held, name)
        todo[:0] = [(child, held) for child in record.children]


def _way(inside: dict[str, dict[str, str]], start: str, end: str) -> tuple[str, ...]:
    """Return who first takes something inside of `start` on the way to `end`, and the names."""
    ways: list[tuple[str, ...]] = [(path, name) for name, path in inside.get(start, {}).items()]
    seen: set[str] = set()
    while ways:
        way = ways.pop()
        if way[-1] == end:
            return way
        if way[-1] not in seen:
            seen.add(way[-1])
            ways += [(*way, name) for name in inside.get(way[-1], {})]
    return ()


def _loops(
    subject: Subject, known: Mapping[str, StateRecord], graph: Graph, reached: set[int]
) -> Iterator[Problem]:
    """Yield the loops of states that lead only to each other: only a preempt can end them."""
    can_end = {*graph.ends.values(), *graph.loose}
    before: dict[int, list[int]] = {}
    for number in reached:
        for after in graph.after(number, framework=False):
            before.setdefault(after, []).append(number)
    queue = list(can_end)
    while queue:
        new = {*before.get(queue.pop(), ())} - can_end
        can_end |= new
        queue += new
    reported: set[tuple[str, ...]] = set()
    only_fails = _only_fails(graph)
    for loop in graph.closed_loops(reached - can_end):
        records = [graph.nodes[number].record for number in loop]
        # The states of the loop itself; the other records are inside them.
        outermost = min(record.path.count("/") for record in records)
        paths = tuple(sorted({r.path for r in records if r.path.count("/") == outermost}))
        parent = paths[0].rpartition("/")[0]
        if paths not in reported and not _is_ended_from_outside(subject, known, parent):
            reported.add(paths)
            instant = all(subject.facts_of(r).instant for r in records if not r.is_container)
            yield _endless(graph, parent, paths, instant=instant, only_fails=only_fails)


def _is_ended_from_outside(subject: Subject, known: Mapping[str, StateRecord], path: str) -> bool:
    """Return whether a timeout, or a callback of a concurrence, ends the container at some time."""
    around = [known[one] for one in (path, *paths_above([path])) if one in known]
    return any("timeout" in dict(record.details) for record in around) or any(
        subject.facts_of(record).cuts for record in around if record.path != path
    )


def _endless(
    graph: Graph, parent: str, paths: tuple[str, ...], *, instant: bool, only_fails: bool
) -> Problem:
    """Return the problem of a loop; only a note if the mission is meant to run for ever.

    If none of its states takes time, a processor is busy for ever and virtual time stands still.
    """
    labels = ", ".join(path.rpartition("/")[2] for path in paths)
    many = len(paths) > 1
    text = f"{parent}: {labels} lead only to {'each other' if many else 'itself'}"
    text += f" and take{'' if many else 's'} no time" if instant else ""
    begins = {number for path in paths for number in graph.begins(path)}
    steps = runs.moments(graph.path([graph.start], begins) or [])
    if only_fails:
        text += "; the mission runs until it is preempted."
        severity: Severity = "warning" if instant else "note"
        hint = "Let a state of it wait, for instance with self.sleep(...)." if instant else ""
        return Problem("endless-loop", severity, parent, text, hint, moments=steps)
    text += "; no outcome ends the loop."
    return Problem(
        "endless-loop", "error", parent, text, "Lead a transition out of it.", moments=steps
    )


def _only_fails(graph: Graph) -> bool:
    """Return whether every run that ends without a preempt is a failure."""
    reached = graph.reachable([graph.start], preempt=False)
    ends = [outcome for outcome, number in graph.ends.items() if number in reached]
    return all(outcome_class(outcome) in {"failure", "preempted"} for outcome in ends)


def _concurrence(
    subject: Subject, known: Mapping[str, StateRecord], record: StateRecord
) -> Iterator[Problem]:
    facts = subject.facts_of(record)
    # An outcome callback may decide before the rules are evaluated.
    combined = [] if facts.any_outcome else runs.combinations(record, subject) or []
    reported: set[frozenset[str]] = set()
    for outcomes in combined:
        holding = [rule for rule in facts.outcome_rules if rule.holds(outcomes)]
        most = max((rule.need for rule in holding), default=0)
        rivals = frozenset(rule.outcome for rule in holding if rule.need == most)
        if len(rivals) > 1 and rivals not in reported:
            reported.add(rivals)
            ends = ", ".join(f"{label}:{outcome}" for label, outcome in outcomes.items())
            text = f"{record.path}: with {ends} the rules for {sorted(rivals)} hold equally; the "
            hint = "Make one of them ask for more."
            yield subject.problem("ambiguous-map", record, text + "last one wins.", hint)
    waiting = [child for child in record.others if _only_preempt_ends(subject, child)]
    if (
        facts.cuts
        or len(waiting) == len(record.others)  # it is meant to run as long as the mission
        or _is_ended_from_outside(subject, known, record.path)
    ):
        return
    for child in waiting:
        text = f"{record.path} waits for {child.label}, which ends only when it is preempted, and "
        hint = "Give the concurrence a child_termination_cb, or the child another way to end."
        yield subject.problem("stuck-concurrence", record, text + "nobody preempts it.", hint)


def _only_preempt_ends(subject: Subject, record: StateRecord) -> bool:
    facts = subject.facts_of(record)
    if record.is_container or facts.returns is None:
        return False
    return set(runs.possible(record, facts)) <= {PREEMPTED}


def _preempts(subject: Subject, record: StateRecord) -> Iterator[Problem]:
    """Yield preempts that a container turns into another outcome, after which others go on."""
    for child, outcome in _preempt_ends(subject, record):
        if outcome != PREEMPTED and _goes_on(subject, record, outcome):
            text = (
                f"{record.path}: a preempt of {child} leaves it by {outcome!r}, so what is around "
            )
            text += "it goes on as if there had been none."
            hint = "Lead it to the outcome 'preempted'."
            yield subject.problem("preempt-outcome", record, text, hint)


def _goes_on(subject: Subject, record: StateRecord, outcome: str) -> bool:
    """Return whether an outcome of a container leads to another state, here or further up."""
    for parent in subject.root.walk():
        for edge in parent.transitions if record in parent.children else ():
            if (edge.source, edge.outcome) == (record.label, outcome):
                ends = edge.target_is_outcome and edge.target != PREEMPTED
                on = _goes_on(subject, parent, edge.target) if ends else edge.target != PREEMPTED
                if on:
                    return True
    return False


def _preempt_ends(subject: Subject, record: StateRecord) -> Iterator[tuple[str, str]]:
    """Yield (child, container outcome) for the outcomes that preempted children lead to."""
    if record.kind == "concurrence":
        facts = subject.facts_of(record)
        if not facts.any_outcome and all(PREEMPTED in c.outcomes for c in record.others):
            ruled = runs.decide(facts, {child.label: PREEMPTED for child in record.others})
            usual = PREEMPTED if PREEMPTED in record.outcomes else record.default_outcome
            if ruled or usual:
                yield "all its children", ruled or usual or ""
        return
    for child in record.children:
        way_out = [
            e for e in record.transitions if (e.source, e.outcome) == (child.label, PREEMPTED)
        ]
        queue = way_out if PREEMPTED in child.outcomes else []
        seen = {child.label}
        ends: set[str] = set()
        while queue:
            at = queue.pop()
            if at.target_is_outcome:
                ends.add(at.target)
            elif at.target not in seen and record.kind != "iterator":
                seen.add(at.target)
                queue += [e for e in record.transitions if e.source == at.target]
        if ends and PREEMPTED not in ends:
            yield child.label, min(ends)
