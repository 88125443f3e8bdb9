"""Problems of plans, with file, line and element."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.pnp.labels import Severity


MAX_TOLD_PROBLEMS: Final = 100
"""Errors in the text of a `PlanError`; its attributes have all."""


@dataclass(frozen=True, slots=True)
class PlanProblem:
    """One problem of a plan.

    Attributes:
        rule: Id of the rule; in `smachpy.checks.RULES` it has the prefix "net-".
        severity: "error": the plan does not run. "warning": it runs, as in PNP, which does not
            report it. "note": information.
        message: The text found and the text expected.
        element: The node, "place 'p1' (A.exec)"; "" for the whole plan.
        file: The file, "" if the plan was built.
        line: The line in it, from 1; 0 if unknown.
        hint: A suggestion, or "".
        run: Labels of the transitions whose firing leads to the problem, first to last.
        marking: The marking that they lead to, as text.
    """

    rule: str
    severity: Severity
    message: str
    element: str = ""
    file: str = ""
    line: int = 0
    hint: str = ""
    run: tuple[str, ...] = ()
    marking: str = ""

    @property
    def where(self) -> str:
        """File and line, as far as they are known."""
        return f"{self.file}:{self.line}" if self.file and self.line else self.file

    def __str__(self) -> str:
        where = ": ".join(part for part in (self.where, self.element) if part)
        text = f"{where}: {self.message}" if where else self.message
        return f"{text} {self.hint}" if self.hint else text


class PlanError(InvalidStateError):
    """A plan cannot be loaded or run.

    Try: correct each problem that is listed; `smachpy check PLAN` shows them with lines.

    Attributes:
        found: All its problems, the errors first.
        problems: Their texts.
    """

    def __init__(self, found: Iterable[PlanProblem]) -> None:
        # The text has the errors only; they alone keep the plan from running.
        order = ("error", "warning", "note")
        self.found = tuple(sorted(found, key=lambda problem: order.index(problem.severity)))
        errors = [str(problem) for problem in self.found if problem.severity == "error"]
        told = errors[:MAX_TOLD_PROBLEMS]
        if len(errors) > MAX_TOLD_PROBLEMS:
            told.append(f"and {len(errors) - MAX_TOLD_PROBLEMS} more.")
        super().__init__("\n".join(told), errors)


def raise_errors(found: Iterable[PlanProblem]) -> None:
    """Raise `PlanError` if there are errors among these problems."""
    found = tuple(found)
    if any(problem.severity == "error" for problem in found):
        raise PlanError(found)
