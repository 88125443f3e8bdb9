"""The rules, the facts that they use, and the problems that they find."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping

    from smachpy.events.introspection import StateRecord

Severity: TypeAlias = Literal["error", "warning", "note"]
Moments: TypeAlias = tuple[tuple[str, str | None], ...]


@dataclass(frozen=True, slots=True)
class CheckRule:
    """One rule.

    Attributes:
        name: Its id.
        severity: The severity of its problems, unless they are milder.
        summary: What it finds.
        is_on: Whether it is on by default.
    """

    name: str
    severity: Severity
    summary: str
    is_on: bool = True


RULES: dict[str, CheckRule] = {
    rule.name: rule
    for rule in (
        CheckRule("inconsistent", "error", "the machine is inconsistent and would not run"),
        CheckRule("wrong-signature", "error", "`execute` cannot be called as the machine calls it"),
        CheckRule("unreachable-state", "error", "no run can reach the state"),
        CheckRule("unmapped-outcome", "error", "an outcome of a state leads nowhere"),
        CheckRule(
            "ambiguous-target", "warning", "a transition to a state that is named as an outcome"
        ),
        CheckRule("impossible-outcome", "warning", "a declared outcome that nothing can produce"),
        CheckRule("undeclared-outcome", "error", "code returns an outcome that is not declared"),
        CheckRule("dead-case", "warning", "a condition of a transition that decides nothing"),
        CheckRule("unset-key", "error", "a userdata key is read on some path before it is written"),
        CheckRule("unread-key", "warning", "a userdata key is written and never read"),
        CheckRule(
            "changed-input", "warning", "code changes the value of a key that is only an input"
        ),
        CheckRule(
            "kept-value", "warning", "a nested machine begins with what its former visit left"
        ),
        CheckRule("endless-loop", "error", "a loop of states with no way out"),
        CheckRule("no-timeout", "warning", "a wait without a timeout", is_on=False),
        CheckRule("outside", "note", "code reads what no recording has", is_on=False),
        CheckRule("deaf-loop", "warning", "`execute` loops without checking for a preempt"),
        CheckRule("stuck-concurrence", "error", "a concurrence that cannot finish"),
        CheckRule("resource-order", "warning", "resources that are taken in different orders"),
        CheckRule(
            "ambiguous-map", "warning", "two rules of an outcome map hold with equal conditions"
        ),
        CheckRule("not-kept", "note", "a part of a file of another tool is lost"),
        CheckRule(
            "preempt-outcome", "warning", "a preempt leaves a container by the wrong outcome"
        ),
        CheckRule("property", "error", "a property that does not hold"),
        CheckRule(
            "net-label", "error", "a label, a condition or a name of a plan that looks wrong"
        ),
        CheckRule(
            "net-unmatched",
            "warning",
            "a plan starts or ends an action, or has a rule for one, without its exec place",
        ),
        CheckRule("net-unbound", "error", "a plan names an action that nothing does"),
        CheckRule("net-condition", "warning", "a guard asks for what nobody is known to say"),
        CheckRule("net-bound", "error", "a place of a plan can hold any number of tokens"),
        CheckRule("net-deadlock", "error", "a plan gets stuck outside its goal"),
        CheckRule("net-goal", "error", "the goal of a plan cannot be reached, or there is none"),
        CheckRule(
            "net-dead", "warning", "a transition that never fires, a place that is never marked"
        ),
        CheckRule("net-race", "warning", "nothing decides which of two ends of an action fires"),
        CheckRule("net-shared", "warning", "two tokens share one run of an action"),
        CheckRule("net-busy", "warning", "a loop of a plan that takes no time"),
    )
}


@dataclass(frozen=True, slots=True)
class Place:
    """A line of the user's code."""

    file: str
    line: int


class Reads(NamedTuple):
    """The userdata keys that a function uses.

    Attributes:
        always: Read in every call.
        sometimes: Read in some calls only: in a branch, or after a possible return.
        writes: Written anywhere.
    """

    always: frozenset[str] = frozenset()
    sometimes: frozenset[str] = frozenset()
    writes: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class OutcomeRule:
    """A concurrence's rule: `need` of the conditions (child label, its outcomes) must hold."""

    outcome: str
    need: int
    conditions: tuple[tuple[str, tuple[str, ...]], ...]

    def holds(self, outcomes: Mapping[str, str]) -> bool:
        """Return whether the children's outcomes fulfil it."""
        met = sum(outcomes.get(label) in wanted for label, wanted in self.conditions)
        return met >= self.need


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts about a state beyond its record; None or empty where nothing is known.

    Attributes:
        place: The place of its code.
        returns: Outcomes that its code can return.
        made: Outcomes that the machine gives it: after a timeout, for an exception.
        undeclared: Outcomes that its code returns and that are not declared.
        reads: Keys that its code reads.
        changes: Keys whose values its code changes in place, with the line.
        instant: Whether its code certainly takes no time.
        prepared: Whether its `on_enter` may write its output keys before it runs.
        reaches: Whether its code may use the userdata of some machine beyond its own keys.
        waits: Waits without a timeout: what waits, and the line.
        loops: Loops that wait and never check for a preempt: what, and the line.
        outside: Reads of files, sockets, the environment and so on, and the line.
        is_function: Whether its code is a plain function, without `self`.
        preset: Keys of the container's userdata that have a value before the run.
        kept: Those of them that no run sets anew: a later run finds what the former one left.
        outcome_rules: A concurrence's rules.
        any_outcome: Whether the concurrence has an outcome callback.
        cuts: Whether the concurrence has a callback that may preempt its children.
        watched: Whether callbacks, or code that cannot be seen, may change the userdata.
        empty: Whether the iterator is known to have no items.
        ignored: Rule id -> why the rule is switched off for this state.
    """

    place: Place | None = None
    returns: frozenset[str] | None = None
    made: frozenset[str] = frozenset()
    undeclared: tuple[tuple[str, Place], ...] = ()
    reads: Reads | None = None
    changes: tuple[tuple[str, Place], ...] = ()
    instant: bool = False
    prepared: bool = False
    reaches: bool = False
    waits: tuple[tuple[str, Place], ...] = ()
    loops: tuple[tuple[str, Place], ...] = ()
    outside: tuple[tuple[str, Place], ...] = ()
    is_function: bool = False
    preset: frozenset[str] = frozenset()
    kept: frozenset[str] = frozenset()
    outcome_rules: tuple[OutcomeRule, ...] = ()
    any_outcome: bool = False
    cuts: bool = False
    watched: bool = False
    empty: bool = False
    ignored: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Problem:
    """A mistake in a machine.

    Attributes:
        rule: Id of the rule.
        severity: "error" and "warning" fail a check, "note" does not.
        path: Path of the state.
        message: The mistake, in one sentence.
        hint: How to correct it.
        place: Line of the code, if known.
        moments: A run that shows it: pairs (path, outcome); the outcome is None where the state
            begins.
        firings: A run of a plan: labels of its transitions.
    """

    rule: str
    severity: Severity
    path: str
    message: str
    hint: str = ""
    place: Place | None = None
    moments: Moments = ()
    firings: tuple[str, ...] = ()

    @property
    def steps(self) -> tuple[str, ...]:
        """The run in words: the states that ended, with outcomes ("/PATROL/DRIVE -aborted->")."""
        last = self.moments[-1:]
        ended = [f"{path} -{outcome}->" for path, outcome in self.moments if outcome is not None]
        return (*ended, *(path for path, outcome in last if outcome is None))


NOTHING = Facts()


@dataclass(frozen=True, slots=True)
class Subject:
    """A machine under check.

    Attributes:
        root: The machine.
        facts: The facts about its states, by path.
        aside: Userdata keys that functions of the states' files write from outside, such as
            callbacks of topics.
    """

    root: StateRecord
    facts: Mapping[str, Facts]
    aside: frozenset[str] = frozenset()

    def facts_of(self, record: StateRecord) -> Facts:
        """Return the facts about a state."""
        return self.facts.get(record.path, NOTHING)

    def problem(
        self,
        rule: str,
        record: StateRecord,
        message: str,
        hint: str,
        *,
        severity: Severity | None = None,
        place: Place | None = None,
        moments: Moments = (),
    ) -> Problem:
        """Return a problem of a state, at its code unless `place` is given."""
        return Problem(
            rule,
            severity or RULES[rule].severity,
            record.path,
            message,
            hint,
            place or self.facts_of(record).place,
            moments,
        )
