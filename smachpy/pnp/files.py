"""Loads a plan of any form together with the files that belong to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from smachpy.base import log
from smachpy.pnp.container import Parameters, read_plan
from smachpy.pnp.mapping import Registered, mapping_beside, read_mapping
from smachpy.pnp.problems import raise_errors

if TYPE_CHECKING:
    from smachpy.pnp.container import PetriNetPlan


def load_plan(
    file: Path | str,
    mapping: Path | str | None = None,
    *,
    to_run: bool = True,
    imports: bool = True,
) -> PetriNetPlan:
    """Load a plan, with the actions and conditions that its mapping file names.

    Warnings are logged.

    Args:
        file: The plan.
        mapping: The mapping file (`smachpy.pnp.mapping`); None: the one beside the plan, if any.
        to_run: False to load a plan with errors in its labels, too, which cannot run.
        imports: False to look at a plan only: nothing that its mapping file names is imported.

    Raises:
        PlanError: one of the files is wrong; all problems at once.
    """
    path = Path(file)
    beside = mapping_beside(path) if mapping is None else Path(mapping)
    given = Registered() if beside is None else read_mapping(beside, imports=imports)
    plan = read_plan(path, Parameters(given.actions, given.conditions, **given.options))
    if to_run:
        raise_errors(plan.problems)
    for problem in plan.problems:
        if problem.severity == "warning":
            log.logwarn(str(problem))
    return plan
