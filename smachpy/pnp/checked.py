"""What `smachpy.checks` tells of a plan: its labels, its net, and names that nothing provides."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from smachpy.checks.model import Place, Problem
from smachpy.pnp.check import check_plan

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy.pnp.container import PetriNetPlan
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
    "busy": "net-busy",
    "unbound": "net-unbound",
    "unknown-condition": "net-condition",
}


def find_problems(plan: PetriNetPlan, path: str) -> Iterator[Problem]:
    """Yield the problems of a plan, which runs at `path` of a machine."""
    for problem in (*check_plan(plan.plan), *plan.binding_problems()):
        yield _as_problem(problem, path)


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
