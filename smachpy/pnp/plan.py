"""A plan: a net whose labels say which actions begin and end; no threads, time or I/O."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from smachpy.exceptions import did_you_mean
from smachpy.pnp.conditions import Condition, atom, both
from smachpy.pnp.labels import BEGINS, place_label, transition_label
from smachpy.pnp.problems import PlanProblem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from smachpy.pnp.labels import Fault, PlaceLabel, Severity, TransitionLabel
    from smachpy.pnp.net import Marking, Net


@dataclass(slots=True)
class Executable:
    """An action of a plan, and the nodes whose labels have its name.

    Attributes:
        name: Its name in the labels: `[ROBOT#]ACTION[_P1[_P2...]]`.
        places: Its exec places.
        starts: Transitions that start or resume it.
        ends: Transitions that end, fail or interrupt it.
    """

    name: str
    places: list[int] = field(default_factory=list)
    starts: list[int] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class Plan:
    """The meaning of a net as a plan.

    Attributes:
        net: The net.
        strict: Whether a guarded end also waits for the end of its action, as in the papers on PNP;
            otherwise only its condition counts, as in PNP's code.
        executables: The actions by name, in the order of their exec places.
        calls: For each transition: pairs (name of an executable, function), in their order.
        conditions: For each transition: the condition as written, or None.
        guards: For each transition: the condition for its firing, or None. `NAME.finished`,
            `NAME.failed` and `NAME.ended` test the end of an executable.
        goals: Place -> tokens that it holds at the goal.
        fails: Place -> tokens that it holds when the plan has failed.
        problems: The problems of the labels.
    """

    net: Net
    strict: bool
    executables: dict[str, Executable]
    calls: tuple[tuple[tuple[str, str], ...], ...]
    conditions: tuple[Condition | None, ...]
    guards: tuple[Condition | None, ...]
    goals: dict[int, int]
    fails: dict[int, int]
    problems: tuple[PlanProblem, ...]

    def is_goal(self, marking: Marking) -> bool:
        """Return whether all goal places hold exactly their tokens."""
        return _holds(self.goals, marking)

    def is_fail(self, marking: Marking) -> bool:
        """Return whether all fail places hold exactly their tokens."""
        return _holds(self.fails, marking)

    def external(self, transition: int) -> tuple[str, ...]:
        """Return the names in the guard of a transition that do not test an action."""
        guard = self.guards[transition]
        return () if guard is None else tuple(n for n in guard.atoms() if "." not in n)

    def externals(self) -> dict[str, list[int]]:
        """Return all names in guards that do not test an action -> transitions with them."""
        found: dict[str, list[int]] = {}
        for number in range(len(self.net.transitions)):
            for name in self.external(number):
                found.setdefault(name, []).append(number)
        return found


def _holds(wanted: dict[int, int], marking: Marking) -> bool:
    return bool(wanted) and all(marking.count(place) == n for place, n in wanted.items())


def element(net: Net, *, place: int = -1, transition: int = -1) -> str:
    """Return the text for a node in problems: "place 'p1' (A.exec)"."""
    if place < 0 and transition < 0:
        return ""
    kind, node = (
        ("place", net.places[place]) if place >= 0 else ("transition", net.transitions[transition])
    )
    name = node.name.strip()
    return f"{kind} {node.id!r} ({name})" if name and name != node.id else f"{kind} {node.id!r}"


def problem_of(
    net: Net,
    rule: str,
    severity: Severity,
    message: str,
    *,
    place: int = -1,
    transition: int = -1,
    hint: str = "",
    run: Iterable[int] = (),
    marking: Marking | None = None,
) -> PlanProblem:
    """Return a problem of a place or a transition of `net`, or of the whole plan."""
    line = 0
    if place >= 0:
        line = net.places[place].line
    elif transition >= 0:
        line = net.transitions[transition].line
    return PlanProblem(
        rule,
        severity,
        message,
        element(net, place=place, transition=transition),
        net.file,
        line,
        hint,
        tuple(net.transition_name(t) for t in run),
        "" if marking is None else net.words(marking),
    )


def understand(net: Net, *, strict: bool = False, problems: Iterable[PlanProblem] = ()) -> Plan:
    """Return the plan that the labels of `net` describe.

    Args:
        net: The net.
        strict: See `Plan`.
        problems: Problems that were found in its file before.
    """
    found = list(problems)
    if not net.places:
        found.append(problem_of(net, "xml", "error", "got no places; expected a plan."))
    places = [place_label(place.name) for place in net.places]
    labels = [transition_label(transition.name) for transition in net.transitions]
    for number, place in enumerate(places):
        found += _problems_of_label(net, place.faults, place=number)
    # Exec places first, so that executables are in their order; transitions may name others.
    executables: dict[str, Executable] = {}
    for number, place in enumerate(places):
        if place.action:
            known = executables.setdefault(place.action, Executable(place.action))
            known.places.append(number)
    calls: list[tuple[tuple[str, str], ...]] = []
    for number, label in enumerate(labels):
        found += _problems_of_label(net, label.faults, transition=number)
        calls.append(tuple(_resolved(net, places, number, label, found)))
        for name, function in calls[-1]:
            known = executables.setdefault(name, Executable(name))
            (known.starts if function in BEGINS else known.ends).append(number)
    plan = Plan(
        net,
        strict,
        executables,
        tuple(calls),
        tuple(label.condition for label in labels),
        tuple(
            _guard(own, label.condition, strict=strict)
            for own, label in zip(calls, labels, strict=True)
        ),
        {n: place.goal for n, place in enumerate(places) if place.goal is not None},
        {n: place.fail for n, place in enumerate(places) if place.fail is not None},
        (),
    )
    # These problems are found with the plan itself, which is frozen.
    found += _label_problems(plan)
    object.__setattr__(plan, "problems", tuple(found))
    return plan


def _problems_of_label(
    net: Net, faults: Iterable[Fault], *, place: int = -1, transition: int = -1
) -> Iterator[PlanProblem]:
    for fault in faults:
        yield problem_of(
            net,
            fault.rule,
            fault.severity,
            fault.message,
            place=place,
            transition=transition,
            hint=fault.hint,
        )


def _resolved(
    net: Net,
    places: list[PlaceLabel],
    number: int,
    label: TransitionLabel,
    found: list[PlanProblem],
) -> Iterator[tuple[str, str]]:
    """Yield the calls of a label; those without a name are for the exec places beside it."""
    for name, function in label.calls:
        if name:
            yield name, function
            continue
        # A start fills the exec place behind it, an end empties the one in front of it.
        beside = net.outputs[number] if function in BEGINS else net.inputs[number]
        names = dict.fromkeys(places[place].action for place, _ in beside if places[place].action)
        if not names:
            side = "behind" if function in BEGINS else "in front of"
            text = f"got {function!r} without a name; expected an exec place {side} it."
            found.append(problem_of(net, "unmatched", "warning", text, transition=number))
        for each in names:
            yield each, function


def _guard(
    calls: tuple[tuple[str, str], ...], condition: Condition | None, *, strict: bool
) -> Condition | None:
    # An interrupt or a start waits for nothing but its own condition.
    ends = [(name, function) for name, function in calls if function in {"end", "fail"}]
    if strict:
        waits = {"end": "finished" if condition is None else "ended", "fail": "failed"}
        own = [atom(f"{name}.{waits[function]}") for name, function in ends]
        parts = [*own, *([] if condition is None else [condition])]
        return both(*parts) if parts else None
    if condition is not None or not ends:
        return condition
    name, function = ends[0]  # as in PNP: only the first
    return atom(f"{name}.{'finished' if function == 'end' else 'failed'}")


def _label_problems(plan: Plan) -> Iterator[PlanProblem]:
    """Yield problems of labels that PNP silently accepts."""
    net = plan.net
    placed = [name for name, known in plan.executables.items() if known.places]
    for name, known in plan.executables.items():
        for place in known.places:
            yield from _unmatched_place(plan, name, place)
        if not known.places:
            numbers = dict.fromkeys((*known.starts, *known.ends))
            for number in numbers:
                yield problem_of(
                    net,
                    "unmatched",
                    "warning",
                    f"got {name!r}, which has no exec place; expected one of {sorted(placed)}."
                    f"{did_you_mean(name, placed)}",
                    transition=number,
                )
    for number, calls in enumerate(plan.calls):
        if not net.inputs[number]:
            text = "takes from no place, so that it never fires; expected an arc to it."
            yield problem_of(net, "no-input", "warning", text, transition=number)
        count = Counter(function for _, function in calls)
        # `_guard` waits for the first of several ends only, as PNP does.
        if count["end"] > 1 and plan.conditions[number] is None and not plan.strict:
            names = [name for name, function in calls if function == "end"]
            others = ", ".join(map(repr, names[1:]))
            yield problem_of(
                net,
                "two-ends",
                "warning",
                f"waits for the end of {names[0]!r} only, and ends {others} even if it runs; "
                "expected a guard for each.",
                transition=number,
                hint=f"Try [and {' '.join(f'{name}.finished' for name in names)}], or strict.",
            )
        if count["resume"]:
            text = "resumes an action, which starts anew here; expected start."
            yield problem_of(net, "resume", "note", text, transition=number)


def _unmatched_place(plan: Plan, name: str, place: int) -> Iterator[PlanProblem]:
    net, known = plan.net, plan.executables[name]
    into = net.producers[place]
    if not set(into) & set(known.starts):
        others = sorted({n for t in into for n, f in plan.calls[t] if f in BEGINS})
        got = f"starts of {others}" if others else "none"
        yield problem_of(
            net,
            "unmatched",
            "warning",
            f"{name!r} is never started on the way to its exec place: got {got}; expected "
            f"'{name}.start'.",
            place=place,
            hint=f"Did you mean '{others[0]}.exec'?" if others else "",
        )
    out = net.consumers[place]
    if not set(out) & set(known.ends):
        others = sorted({n for t in out for n, f in plan.calls[t] if f not in BEGINS})
        got = f"ends of {others}" if others else "none"
        yield problem_of(
            net,
            "unmatched",
            "warning",
            f"{name!r} is never ended behind its exec place: got {got}; expected '{name}.end'.",
            place=place,
            hint=f"Did you mean '{others[0]}.exec'?" if others else "",
        )
