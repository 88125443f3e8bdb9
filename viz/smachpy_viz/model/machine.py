"""The model of a picture: the states of a machine, as deep as they are opened, and marks on them.

Everything here is frozen, and independent of colours, layouts and files.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

MISSING = "missing"
"""Kind of a state that is a target in a machine but does not exist."""

PLACE, TRANSITION = "place", "transition"
"""Kinds of the nodes of a plan's net; a place with a role has the kind "goal place", ..."""


@dataclass(frozen=True, slots=True)
class Edge:
    """The transitions of one container from one state to one target.

    Attributes:
        source: Label of a child.
        target: Label of a child, or an outcome of the container.
        to_outcome: Whether `target` is an outcome.
        outcomes: The outcomes of `source` that lead there.
        implicit: Nobody wrote these transitions down; the outcome has the target's name.
        back: Points against the reading direction.
        change: `added` or `removed`, where two versions are compared.
        note: Numbers, or the condition, for its label.
    """

    source: str
    target: str
    to_outcome: bool
    outcomes: tuple[str, ...]
    implicit: bool = False
    back: bool = False
    change: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class RulePicture:
    """How several children of a container decide on its outcome together.

    Attributes:
        outcome: The container's outcome.
        conditions: Pairs (child label, child outcome).
        text: The rule in words.
        change: As in `Edge`.
    """

    outcome: str
    conditions: tuple[tuple[str, str], ...]
    text: str
    change: str = ""


@dataclass(frozen=True, slots=True)
class Pill:
    """An outcome on the border of an open container.

    Attributes:
        by_default: Only implicit transitions lead to it.
    """

    outcome: str
    by_default: bool


@dataclass(frozen=True, slots=True)
class Node:
    """A state in a picture.

    Attributes:
        path: `/ROOT/CHILD`.
        kind: As in `smachpy.introspection.StateRecord`, or `MISSING`.
        details: Pairs (name, value) for the tooltip.
        hidden: Number of states inside that the picture does not show.
        children: Empty for a leaf and for a closed container.
        initial: Labels of the children that start first.
        pills: Outcomes on the border of an open container.
        change: `added`, `removed` or `changed`, where two versions are compared.
        note: Numbers, for a second line of its label.
        caption: Shown instead of the label, which is only an id then; in nets.
        tokens: Tokens of a place.
        success: The outcomes that are good; None goes by their names.
    """

    path: str
    label: str
    kind: str
    type_name: str = ""
    doc: str = ""
    details: tuple[tuple[str, str], ...] = ()
    outcomes: tuple[str, ...] = ()
    hidden: int = 0
    children: tuple[Node, ...] = ()
    initial: tuple[str, ...] = ()
    edges: tuple[Edge, ...] = ()
    rules: tuple[RulePicture, ...] = ()
    default_outcome: str | None = None
    pills: tuple[Pill, ...] = ()
    change: str = ""
    note: str = ""
    caption: str = ""
    tokens: int = 0
    success: tuple[str, ...] | None = None

    @property
    def is_open(self) -> bool:
        """Whether its children are drawn."""
        return bool(self.children)

    def walk(self) -> Iterator[Node]:
        """Yield this node and everything below, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()


@dataclass(frozen=True, slots=True)
class Marks:
    """The marks of a run on a machine.

    Attributes:
        active: Paths of the states that are running, containers included.
        visits: Times each state was entered, by path.
        last: Outcome with which each state was last left, by path.
        taken: Times each transition was taken, by (path of the state left, outcome).
        runs: Number of recorded runs that were counted; 0 for a single run, whose end is shown.
        heat: How hot each state is, 0 to 1, by path.
        notes: Numbers for a second line of a state's label, by path.
    """

    active: frozenset[str] = frozenset()
    visits: Mapping[str, int] = field(default_factory=dict)
    last: Mapping[str, str] = field(default_factory=dict)
    taken: Mapping[tuple[str, str], int] = field(default_factory=dict)
    runs: int = 0
    heat: Mapping[str, float] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)

    def share(self, path: str, outcomes: Sequence[str]) -> float | None:
        """Return how often a state ended with one of `outcomes`, 0 to 1; None if it never ended."""
        ends = {key: n for key, n in self.taken.items() if key[0] == path}
        total = sum(ends.values())
        return sum(ends.get((path, o), 0) for o in outcomes) / total if total else None

    @property
    def has_run(self) -> bool:
        """Whether there is a history, so that parts without visits are drawn faint."""
        return bool(self.visits)


@dataclass(frozen=True, slots=True)
class Diagram:
    """A picture without its look.

    Attributes:
        root: The outermost state.
        marks: What to highlight.
        links: Address of the page of a container, by path, for linked pages.
        legend: The meaning of the signs, as pairs (change or "", words); shown beside the title.
        compared: Whether two versions are compared; unchanged parts are drawn faint then.
    """

    root: Node
    marks: Marks = field(default_factory=Marks)
    links: Mapping[str, str] = field(default_factory=dict)
    legend: tuple[tuple[str, str], ...] = ()
    compared: bool = False
