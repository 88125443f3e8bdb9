"""Finds problems of a plan without running it; no threads, time or I/O."""

from __future__ import annotations

from collections import Counter
from graphlib import CycleError, TopologicalSorter
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, TypeVar

from smachpy.pnp.plan import problem_of
from smachpy.pnp.reach import explore

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Iterator, Mapping

    from smachpy.pnp.conditions import Condition
    from smachpy.pnp.plan import Plan
    from smachpy.pnp.problems import PlanProblem
    from smachpy.pnp.reach import Reachable

T = TypeVar("T", bound="Hashable")

MAX_SHOWN_PROBLEMS = 20
"""Dead transitions, and unmarked places, that are reported one by one; the rest is counted."""


def check_plan(plan: Plan) -> tuple[PlanProblem, ...]:
    """Return the problems of a plan's labels, and of the markings that its net can reach.

    Guards count as true or false at any time, so the guards may rule out a run that is shown.
    """
    # The search is done once, for all rules of the net.
    reached = explore(plan.net)
    return (*plan.problems, *_net_problems(plan, reached))


def _net_problems(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    net = plan.net
    if not net.initial:
        text = "got no token in any place; expected an initial marking."
        yield problem_of(net, "no-token", "error", text)
        return
    if reached.covering is not None:  # the search has ended there: more cannot be said
        yield _unbounded(plan, reached)
        return
    if not reached.complete:
        text = f"has more than {len(reached.came) - 1} markings; the others were not checked."
        yield problem_of(net, "too-many", "note", text)
    yield from _ends(plan, reached)
    if reached.complete:  # otherwise the rest of the markings may have them
        yield from _never(plan, reached)
    yield from _shared(plan, reached)
    yield from _races(plan, reached)
    yield from _busy(plan, reached)


def _unbounded(plan: Plan, reached: Reachable) -> PlanProblem:
    assert reached.covering is not None
    before, marking = reached.covering
    place = next(iter(Counter(marking) - Counter(before)))
    text = f"can hold any number of tokens: {plan.net.words(before)} leads to more of the same."
    run = reached.run_to(marking)
    return problem_of(
        plan.net,
        "unbounded",
        "error",
        text,
        place=place,
        hint="Expected a bound.",
        run=run,
        marking=marking,
    )


def _ends(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    """Yield the problems of the plan's goal, of its failure, and deadlocks."""
    net = plan.net
    if not plan.goals:
        text = "has no goal place: the plan ends with 'fail' when nothing can fire any more."
        yield problem_of(net, "no-goal", "note", text, hint="Try the label 'goal'.")
    elif reached.complete and not any(map(plan.is_goal, reached.came)):
        names = [net.name_of(place) for place in plan.goals]
        text = f"no firing sequence leads to the goal: expected tokens in all of {names} at once."
        yield problem_of(net, "unreachable-goal", "error", text, place=next(iter(plan.goals)))
    if plan.fails and reached.complete and not any(map(plan.is_fail, reached.came)):
        names = [net.name_of(place) for place in plan.fails]
        text = f"no firing sequence leads to the failed plan: expected tokens in all of {names}."
        yield problem_of(net, "unreachable-fail", "warning", text, place=next(iter(plan.fails)))
    # The nearest deadlock is shown, the others are counted.
    stuck = [m for m in reached.dead if not (plan.is_goal(m) or plan.is_fail(m))]
    if stuck and plan.goals:
        more = f" The same holds for {len(stuck) - 1} more markings." if len(stuck) > 1 else ""
        words = net.words(stuck[0])
        text = f"nothing can fire in {words}, which is not a goal; expected a transition.{more}"
        place = stuck[0][0] if stuck[0] else -1
        yield problem_of(
            net,
            "deadlock",
            "error",
            text,
            place=place,
            run=reached.run_to(stuck[0]),
            marking=stuck[0],
        )


def _never(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    # Transitions without inputs have a rule of their own, "no-input".
    net = plan.net
    transitions = [
        t for t in range(len(net.transitions)) if t not in reached.fired and net.inputs[t]
    ]
    for number in transitions[:MAX_SHOWN_PROBLEMS]:
        text = "can never fire: no firing sequence fills its places."
        yield problem_of(net, "dead-transition", "warning", text, transition=number)
    places = [p for p in range(len(net.places)) if p not in reached.most]
    for number in places[:MAX_SHOWN_PROBLEMS]:
        text = "is never marked: no firing sequence puts a token there."
        yield problem_of(net, "unmarked-place", "warning", text, place=number)
    hidden = len(transitions[MAX_SHOWN_PROBLEMS:]) + len(places[MAX_SHOWN_PROBLEMS:])
    if hidden:
        text = f"has {hidden} more places and transitions that no firing sequence gets to."
        yield problem_of(net, "dead-transition", "warning", text)


def _shared(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    """Yield the actions whose single run two tokens share."""
    net = plan.net
    for name, known in plan.executables.items():
        places = known.places
        if len(places) == 1 and reached.most.get(places[0], 0) <= 1:
            continue
        own = set(places)
        for marking in reached.came:
            marked = [place for place in marking if place in own]
            if len(marked) > 1:
                labels = sorted({net.places[place].id for place in marked})
                text = (
                    f"{name!r} runs once for {len(marked)} tokens, in {labels}: if it ends for "
                    "one, it ends for all. Expected one token, or different names."
                )
                # One example for each name is enough.
                yield problem_of(
                    net,
                    "shared-name",
                    "warning",
                    text,
                    place=marked[-1],
                    run=reached.run_to(marking),
                    marking=marking,
                )
                break


def _races(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    """Yield pairs of ends of one exec place that may fire at the same time."""
    net = plan.net
    for name, known in plan.executables.items():
        for place in known.places:
            ends = [
                t
                for t in net.consumers[place]
                if (name, "end") in plan.calls[t] and t in reached.fired
            ]
            for one, other in combinations(ends, 2):
                # The conditions as written: the guards also have the tests of the actions.
                if not _may_both_hold(plan.conditions[one], plan.conditions[other]):
                    continue
                # They race only if both have their tokens at the same marking.
                marking = next(
                    (
                        m
                        for m in reached.came
                        if place in m and net.has_tokens(m, one) and net.has_tokens(m, other)
                    ),
                    None,
                )
                if marking is None:
                    continue
                text = (
                    f"races with {net.transition_name(other)!r} (transition "
                    f"{net.transitions[other].id!r}) for the token of {name!r}; the first in the "
                    "file wins. Expected conditions that exclude each other."
                )
                yield problem_of(
                    net,
                    "race",
                    "warning",
                    text,
                    transition=one,
                    run=reached.run_to(marking),
                    marking=marking,
                )


def _busy(plan: Plan, reached: Reachable) -> Iterator[PlanProblem]:
    """Yield a loop of firings in which nothing waits: neither a guard nor the end of an action."""
    net = plan.net
    free = {t for t in reached.fired if plan.guards[t] is None}
    # Few nets have a loop of places through such transitions; only their markings are looked at.
    places = {place: set[int]() for place in range(len(net.places))}
    for transition in free:
        for place, _ in net.inputs[transition]:
            places[place] |= {to for to, _ in net.outputs[transition]}
    if not _loop(places):
        return
    after = {
        marking: {net.fire(marking, t): t for t in net.enabled(marking) if t in free}
        for marking in reached.came
        if not (plan.is_goal(marking) or plan.is_fail(marking))  # there it ends
    }
    loop = _loop(after)
    if loop:
        fired = [after[one][other] for one, other in pairwise(loop)]
        names = ", ".join(dict.fromkeys(map(net.transition_name, fired)))
        words = net.words(loop[0])
        text = f"fires for ever without taking time: {names} lead from {words} back to it."
        yield problem_of(
            net,
            "busy",
            "warning",
            text,
            transition=fired[0],
            hint="Put an action or a condition into the loop.",
            run=reached.run_to(loop[0]),
            marking=loop[0],
        )


def _loop(after: Mapping[T, Collection[T]]) -> list[T]:
    """Return a way through a graph (node -> its successors) that ends where it began, or []."""
    try:
        TopologicalSorter(after).prepare()
    except CycleError as error:
        return list(reversed(error.args[1]))  # it takes successors for predecessors
    return []


def _may_both_hold(one: Condition | None, other: Condition | None) -> bool:
    """Return whether two ends race: they have the same condition, or one has none.

    Two different conditions count as exclusive, as "door_open" and "not door_open" are.
    """
    return one is None or other is None or one == other
