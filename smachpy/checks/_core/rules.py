"""The rules by id: severity and one line of what they find."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smachpy.checks._core.model import Severity


@dataclass(frozen=True, slots=True)
class Rule:
    """One thing that is looked for."""

    name: str
    severity: Severity
    summary: str


RULES: dict[str, Rule] = {
    rule.name: rule
    for rule in (
        Rule("inconsistent", "error", "the machine does not hold together and would not run"),
        Rule("unreachable-state", "error", "no run can get to the state"),
        Rule("unmapped-outcome", "error", "an outcome of a state leads nowhere"),
        Rule("impossible-outcome", "warning", "a declared outcome that nothing can produce"),
        Rule("undeclared-outcome", "error", "code returns an outcome that is not declared"),
        Rule("unset-key", "error", "a userdata key is read on some path before anyone writes it"),
        Rule("unread-key", "warning", "a userdata key is written and never read"),
        Rule("endless-loop", "error", "a loop of states with no way out"),
        Rule("no-timeout", "warning", "a wait without a timeout"),
        Rule("deaf-loop", "warning", "`execute` loops without looking at the preempt"),
        Rule("stuck-concurrence", "error", "a concurrence that cannot finish"),
        Rule(
            "ambiguous-map", "warning", "two rules of an outcome map hold at once and ask equally"
        ),
        Rule("preempt-outcome", "warning", "a preempt leaves a container by the wrong outcome"),
        Rule("property", "error", "a property that does not hold"),
    )
}
