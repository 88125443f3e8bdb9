"""Checks plans: their labels, their nets, and names that nothing provides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from smachpy.checks.model import Place, Problem
from smachpy.machines.container import Container
from smachpy.pnp.check import check_plan
from smachpy.pnp.container import PetriNetPlan

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.machines.state import State
    from smachpy.pnp.problems import PlanProblem

_RULES: Final = {
    "label": "net-label",
    "lost-guard": "net-label",
    "comment": "net-label",
    "condition": "net-label",
    "arc": "net-label",
    "number": "net-label",
    "xml": "net-label",
    "resume": "net-label",
    "unmatched": "net-unmatched",
    "unbounded": "net-bound",
    "too-many": "net-bound",
    "deadlock": "net-deadlock",
    "no-token": "net-deadlock",
    "no-goal": "net-goal",
    "unreachable-goal": "net-goal",
    "unreachable-fail": "net-goal",
    "dead-transition": "net-dead",
    "unmarked-place": "net-dead",
    "no-input": "net-dead",
    "race": "net-race",
    "two-ends": "net-race",
    "shared-name": "net-shared",
    "unbound": "net-unbound",
    "unknown-condition": "net-condition",
}


def find(state: State, path: str) -> Iterator[Problem]:
    """Yield the problems of the plans in a machine."""
    if isinstance(state, PetriNetPlan):
        for problem in (*check_plan(state.plan), *state.binding_problems()):
            yield _as_problem(problem, path)
    for label, child in state.get_children().items() if isinstance(state, Container) else ():
        yield from find(child, f"{path}/{label}")


def _as_problem(problem: PlanProblem, path: str) -> Problem:
    where = f"{path}: {problem.element}" if problem.element else path
    place = Place(problem.file, max(1, problem.line)) if problem.file else None
    return Problem(
        _RULES[problem.rule],
        problem.severity,
        path,
        f"{where}: {problem.message}",
        problem.hint,
        place,
        firings=problem.run,
    )
