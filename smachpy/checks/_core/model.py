"""What the rules look at and what they find."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

    from smachpy.introspection import StateRecord

Severity: TypeAlias = Literal["error", "warning", "note"]


@dataclass(frozen=True, slots=True)
class Place:
    """A line of the user's code."""

    file: str
    line: int


@dataclass(frozen=True, slots=True)
class OutcomeRule:
    """A concurrence's rule: `need` of the conditions (child label, its outcomes) must hold."""

    outcome: str
    need: int
    conditions: tuple[tuple[str, tuple[str, ...]], ...]

    def holds(self, outcomes: Mapping[str, str]) -> bool:
        """Tell whether the children's outcomes fulfil it."""
        met = sum(outcomes.get(label) in wanted for label, wanted in self.conditions)
        return met >= self.need


@dataclass(frozen=True, slots=True)
class Facts:
    """What is known of a state beyond its record; None or empty where nothing is known.

    Attributes:
        place: Where its code is.
        returns: Outcomes that its code can end with.
        made: Outcomes that the machine gives it: after a timeout, for an exception.
        undeclared: Outcomes that its code names in a `return` and that are not declared.
        reads: Keys that its code certainly reads.
        waits: Waits without a limit: what waits, and the line.
        loops: Loops that wait and never look at the preempt: what, and the line.
        is_function: Its code is a plain function, which has no `self`.
        preset: Keys of the container's userdata that have a value before the run.
        outcome_rules: A concurrence's rules.
        any_outcome: The concurrence has an outcome callback.
        cuts: The concurrence has a callback that may preempt its children.
        watched: Callbacks see the container's whole userdata.
        empty: Whether the iterator is known to have no items.
        ignored: Rule id -> why the rule is switched off for this state.
    """

    place: Place | None = None
    returns: frozenset[str] | None = None
    made: frozenset[str] = frozenset()
    undeclared: tuple[tuple[str, Place], ...] = ()
    reads: frozenset[str] | None = None
    waits: tuple[tuple[str, Place], ...] = ()
    loops: tuple[tuple[str, Place], ...] = ()
    is_function: bool = False
    preset: frozenset[str] = frozenset()
    outcome_rules: tuple[OutcomeRule, ...] = ()
    any_outcome: bool = False
    cuts: bool = False
    watched: bool = False
    empty: bool = False
    ignored: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Problem:
    """Something wrong.

    Attributes:
        rule: Id of the rule.
        severity: "error" and "warning" fail a check, "note" does not.
        path: Path of the state.
        message: What is wrong, in one sentence.
        hint: What to do about it.
        place: Line of the code, when known.
        moments: A run that shows it: pairs (path, outcome), the outcome None where the state
            begins.
    """

    rule: str
    severity: Severity
    path: str
    message: str
    hint: str = ""
    place: Place | None = None
    moments: tuple[tuple[str, str | None], ...] = ()

    @property
    def steps(self) -> tuple[str, ...]:
        """The run in words: what ended, and how ("/PATROL/DRIVE -aborted->")."""
        last = self.moments[-1:]
        ended = [f"{path} -{outcome}->" for path, outcome in self.moments if outcome is not None]
        return (*ended, *(path for path, outcome in last if outcome is None))


NOTHING = Facts()


@dataclass(frozen=True, slots=True)
class Subject:
    """A machine under check."""

    root: StateRecord
    facts: Mapping[str, Facts]

    def facts_of(self, record: StateRecord) -> Facts:
        """Return what is known of a state."""
        return self.facts.get(record.path, NOTHING)
