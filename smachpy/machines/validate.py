"""The structure of a container as immutable data, and the search for its problems."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from smachpy.exceptions import did_you_mean
from smachpy.slips import accepts

if TYPE_CHECKING:
    from collections.abc import Iterable

    from smachpy.machines.rules import Rule


@dataclass(frozen=True, slots=True)
class ChildSpec:
    """One child of a container.

    Attributes:
        label: Its name in the container.
        outcomes: Its outcomes.
        transitions: Pairs (outcome, target); with the target None the outcome leads to the
            container's outcome of the same name.
    """

    label: str
    outcomes: tuple[str, ...]
    transitions: tuple[tuple[str, str | None], ...] = ()

    def targets(self) -> dict[str, str | None]:
        """Return outcome -> target, for every outcome."""
        return dict.fromkeys(self.outcomes) | dict(self.transitions)


@dataclass(frozen=True, slots=True)
class MachineSpec:
    """A state machine: one child at a time."""

    where: str
    outcomes: tuple[str, ...]
    children: tuple[ChildSpec, ...]
    initial: str | None


@dataclass(frozen=True, slots=True)
class ConcurrenceSpec:
    """A concurrence: all children at once."""

    where: str
    outcomes: tuple[str, ...]
    children: tuple[ChildSpec, ...]
    default: str | None
    rules: tuple[tuple[str, Rule], ...] = ()


@dataclass(frozen=True, slots=True)
class LoopSpec:
    """An iterator: one child again and again."""

    where: str
    outcomes: tuple[str, ...]
    child: ChildSpec | None
    exhausted: str
    loop: tuple[str, ...] = ()
    breaks: tuple[str, ...] = ()
    final: tuple[tuple[str, str], ...] = ()


def machine_problems(spec: MachineSpec) -> tuple[str, ...]:
    """Return the problems of a state machine."""
    problems: list[str] = []
    labels = [child.label for child in spec.children]
    if not labels:
        problems.append(f"{spec.where}: states: got none; expected at least one. Try add().")
    elif spec.initial not in labels:
        problems.append(
            f"{spec.where}: initial state: got {spec.initial!r}; expected one of "
            f"{sorted(labels)}.{did_you_mean(spec.initial, labels)}"
        )
    for child in spec.children:
        problems += _child_problems(spec, child, labels)
    return tuple(problems)


def _child_problems(spec: MachineSpec, child: ChildSpec, labels: list[str]) -> Iterable[str]:
    where = f"{spec.where}/{child.label}"
    if not child.outcomes:
        problem = f"{where}: outcomes: got none; expected at least one."
        if not accepts(problem):
            yield problem
    for outcome, target in child.targets().items():
        if outcome not in child.outcomes:
            yield (
                f"{where}: transition from an unknown outcome: got {outcome!r}; expected one of "
                f"{sorted(child.outcomes)}.{did_you_mean(outcome, child.outcomes)}"
            )
        elif target is None or target == "":
            if outcome not in spec.outcomes:
                yield (
                    f"{where}: outcome has no transition: got {outcome!r}; expected a transition, "
                    f"or a container outcome of that name among {sorted(spec.outcomes)}."
                    f"{did_you_mean(outcome, spec.outcomes)}"
                )
        elif target not in labels and target not in spec.outcomes:
            known = [*labels, *spec.outcomes]
            yield (
                f"{where}: transition {outcome!r} leads nowhere: got {target!r}; expected one of "
                f"the states {sorted(labels)} or outcomes {sorted(spec.outcomes)}."
                f"{did_you_mean(target, known)}"
            )


def concurrence_problems(spec: ConcurrenceSpec) -> tuple[str, ...]:
    """Return the problems of a concurrence."""
    problems: list[str] = []
    if not spec.children:
        problems.append(f"{spec.where}: states: got none; expected at least one. Try add().")
    if spec.default is not None:
        problems += _unknown(f"{spec.where}: default outcome", spec.default, spec.outcomes)
    outcomes = {child.label: child.outcomes for child in spec.children}
    for outcome, rule in spec.rules:
        where = f"{spec.where}: outcome map"
        problems += _unknown(where, outcome, spec.outcomes)
        for label, wanted in rule.conditions:
            problems += _unknown(f"{where}: {outcome!r}", label, outcomes)
            for child_outcome in wanted:
                if label in outcomes:
                    problems += _unknown(
                        f"{where}: {outcome!r}: outcome of {label}",
                        child_outcome,
                        (*outcomes[label], "preempted"),
                    )
    return tuple(problems)


def loop_problems(spec: LoopSpec) -> tuple[str, ...]:
    """Return the problems of an iterator."""
    if spec.child is None:
        return (f"{spec.where}: contained state: got none; expected one. Try set_contained_state.",)
    problems: list[str] = []
    final = dict(spec.final)
    child = spec.child
    for what, names in (("loop", spec.loop), ("break", spec.breaks), ("final", tuple(final))):
        for name in names:
            if what != "final" or name != spec.exhausted:
                problems += _unknown(
                    f"{spec.where}/{child.label}: {what} outcome", name, child.outcomes
                )
    for name in (*spec.breaks, spec.exhausted):
        problems += _unknown(
            f"{spec.where}: outcome after {name!r}", final.get(name, name), spec.outcomes
        )
    return tuple(problems)


def _unknown(what: str, got: str, known: Iterable[str]) -> list[str]:
    known = sorted(known)
    if got in known:
        return []
    problem = f"{what}: got {got!r}; expected one of {known}.{did_you_mean(got, known)}"
    return [] if accepts(problem) else [problem]
