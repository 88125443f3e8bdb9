"""The rules by which the outcomes of parallel children decide the outcome of a concurrence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from smachpy.base.frozen import Frozen
from smachpy.base.problems import as_number, plain, unique_names
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Iterable


class Rule(Frozen):
    """Holds if at least `need` of the conditions hold.

    Attributes:
        need: Number of conditions that must hold.
        conditions: Pairs (child label, outcomes); it holds if the child has one of these outcomes.
    """

    __slots__ = ("need", "conditions")  # noqa: RUF023  in the order of the arguments

    need: int
    conditions: tuple[tuple[str, tuple[str, ...]], ...]

    def __init__(self, need: int, conditions: tuple[tuple[str, tuple[str, ...]], ...]) -> None:
        self._set(need=need, conditions=conditions)

    def holds(self, outcomes: Mapping[str, str | None]) -> bool:
        """Return whether the children's outcomes fulfil the rule."""
        return len(self.met_by(outcomes)) >= self.need

    def met_by(self, outcomes: Mapping[str, str | None]) -> tuple[str, ...]:
        """Return the labels of the children that meet their condition."""
        return tuple(label for label, wanted in self.conditions if outcomes.get(label) in wanted)

    def __str__(self) -> str:
        parts = ", ".join(f"{label}:{'|'.join(wanted)}" for label, wanted in self.conditions)
        if len(self.conditions) == 1:
            return parts
        if self.need == len(self.conditions):
            return f"all of {parts}"
        return f"any of {parts}" if self.need == 1 else f"{self.need} of {parts}"


def all_of(conditions: Mapping[str, str | Iterable[str]]) -> Rule:
    """Return a rule: every child named here must have its outcome, or one of its outcomes."""
    made = _conditions(conditions)
    return Rule(len(made), made)


def any_of(conditions: Mapping[str, str | Iterable[str]]) -> Rule:
    """Return a rule: at least one child named here must have its outcome, or one of them.

    Raises:
        InvalidStateError: there is no condition, so that the rule would never hold.
    """
    made = _conditions(conditions)
    if not made:
        raise InvalidStateError("any_of: got no conditions; expected at least one.")
    return Rule(1, made)


def n_of(n: int, conditions: Mapping[str, str | Iterable[str]]) -> Rule:
    """Return a rule: at least `n` of the children named here must have their outcome.

    Raises:
        InvalidStateError: `n` is not between 1 and the number of conditions.
    """
    made = _conditions(conditions)
    if as_number(n) is None or not 1 <= n <= len(made) or int(n) != n:
        raise InvalidStateError(
            f"n_of: got n={n!r} with {len(made)} conditions; expected 1 <= n <= {len(made)}."
        )
    return Rule(int(n), made)


def as_rules(outcome_map: Mapping[str, Any]) -> tuple[tuple[str, Rule], ...]:
    """Convert an `outcome_map` to pairs (container outcome, rule)."""
    return tuple(
        (plain(outcome), rule if isinstance(rule, Rule) else all_of(rule))
        for outcome, rule in outcome_map.items()
    )


def decide(
    rules: Iterable[tuple[str, Rule]], outcomes: Mapping[str, str | None]
) -> tuple[str, Rule] | None:
    """Return the rule that holds and needs most conditions, with its outcome; None if none holds.

    Among rules that need equally many, the last one wins, as in SMACH.
    """
    best: tuple[str, Rule] | None = None
    for outcome, rule in rules:
        if (best is None or rule.need >= best[1].need) and rule.holds(outcomes):
            best = outcome, rule
    return best


def _conditions(
    conditions: Mapping[str, str | Iterable[str]],
) -> tuple[tuple[str, tuple[str, ...]], ...]:
    if not isinstance(conditions, Mapping):
        raise InvalidStateError(
            f"rule: got {conditions!r}; expected a dict: child label -> outcome, or outcomes."
        )
    made = []
    for label, wanted in conditions.items():
        names = unique_names([wanted] if isinstance(wanted, str) else wanted, f"rule {label!r}")
        if not names:  # it would never hold
            raise InvalidStateError(f"rule {label!r}: got no outcome; expected at least one.")
        made.append((plain(label) if isinstance(label, str) else label, names))
    return tuple(made)
