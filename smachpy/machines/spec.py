"""What a container is made of, as data that cannot change: the input of all decisions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smachpy.machines.rules import Rule


@dataclass(frozen=True, slots=True)
class ChildSpec:
    """One child of a container.

    Attributes:
        label: Its name in the container.
        outcomes: Its outcomes.
        transitions: Pairs (outcome, target); a target None falls through to the container outcome
            of the same name.
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
