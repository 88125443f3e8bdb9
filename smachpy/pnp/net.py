"""Petri nets: places, transitions, arcs, markings and firing; no threads, time or I/O.

A marking is the sorted tuple of the numbers of the marked places; a place with two tokens is in it
twice. Plans have few tokens and up to thousands of places, so firing must not take time for places
that are not marked.
"""

from __future__ import annotations

from bisect import insort
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterator

Marking: TypeAlias = tuple[int, ...]


MAX_PARTS: Final = 20_000
"""Places, transitions and arcs of a net; its checks take minutes for more."""


@dataclass(frozen=True, slots=True)
class Place:
    """A place.

    Attributes:
        id: Its id, unique among all nodes of the net.
        name: Its label; for a plan see `smachpy.pnp.labels`.
        tokens: Its tokens in the initial marking.
        line: Its line in the file; 0 if the net is not from a file.
    """

    id: str
    name: str = ""
    tokens: int = 0
    line: int = 0


@dataclass(frozen=True, slots=True)
class Transition:
    """A transition; attributes as those of a place."""

    id: str
    name: str = ""
    line: int = 0


@dataclass(frozen=True, slots=True)
class Arc:
    """An arc between nodes, by their ids: one is a place, one a transition."""

    source: str
    target: str
    weight: int = 1


@dataclass(frozen=True)
class Net:
    """A place/transition net with weights.

    Attributes:
        name: Its name.
        places: The places in the order of the document; numbers of places are indices of it.
        transitions: Likewise.
        arcs: The arcs; two between the same nodes count as one with the sum of their weights.
        file: The file that it was read from; "" if it was built.

    Raises:
        ValueError: an id is used twice, or an arc does not join a place and a transition.
    """

    name: str
    places: tuple[Place, ...]
    transitions: tuple[Transition, ...]
    arcs: tuple[Arc, ...]
    file: str = ""

    def __post_init__(self) -> None:
        if len(self.places) + len(self.transitions) + len(self.arcs) > MAX_PARTS:
            raise ValueError(f"net {self.name!r}: got more than {MAX_PARTS:,} nodes and arcs.")
        nodes: tuple[Place | Transition, ...] = (*self.places, *self.transitions)
        count = Counter(node.id for node in nodes)
        twice = sorted(name for name, number in count.items() if number > 1)
        if twice:
            raise ValueError(f"net {self.name!r}: ids: got {twice} twice; expected unique ids.")
        places = self.place_numbers
        for arc in self.arcs:
            known = arc.source in count and arc.target in count
            if not known or (arc.source in places) == (arc.target in places):
                raise ValueError(
                    f"net {self.name!r}: arc: got {arc.source!r} -> {arc.target!r}; expected a "
                    "place and a transition of the net."
                )
            if arc.weight < 1:
                raise ValueError(f"net {self.name!r}: arc: got weight {arc.weight}; expected >= 1.")

    @cached_property
    def place_numbers(self) -> dict[str, int]:
        """The number of each place, by id."""
        return {place.id: number for number, place in enumerate(self.places)}

    @cached_property
    def transition_numbers(self) -> dict[str, int]:
        """The number of each transition, by id."""
        return {transition.id: number for number, transition in enumerate(self.transitions)}

    @cached_property
    def inputs(self) -> tuple[tuple[tuple[int, int], ...], ...]:
        """For each transition: pairs (place, weight) of the tokens that it takes."""
        return self._weights(into_transition=True)

    @cached_property
    def outputs(self) -> tuple[tuple[tuple[int, int], ...], ...]:
        """For each transition: pairs (place, weight) of the tokens that it gives."""
        return self._weights(into_transition=False)

    def _weights(self, *, into_transition: bool) -> tuple[tuple[tuple[int, int], ...], ...]:
        found: list[Counter[int]] = [Counter() for _ in self.transitions]
        for arc in self.arcs:
            place, transition = arc.source, arc.target
            if not into_transition:
                place, transition = transition, place
            if transition in self.transition_numbers:
                number = self.transition_numbers[transition]
                found[number][self.place_numbers[place]] += arc.weight
        return tuple(tuple(sorted(counter.items())) for counter in found)

    @cached_property
    def consumers(self) -> tuple[tuple[int, ...], ...]:
        """For each place: the transitions that take from it."""
        return self._by_place(self.inputs)

    @cached_property
    def producers(self) -> tuple[tuple[int, ...], ...]:
        """For each place: the transitions that give to it."""
        return self._by_place(self.outputs)

    def _by_place(
        self, weights: tuple[tuple[tuple[int, int], ...], ...]
    ) -> tuple[tuple[int, ...], ...]:
        found: list[list[int]] = [[] for _ in self.places]
        for number, pairs in enumerate(weights):
            for place, _ in pairs:
                found[place].append(number)
        return tuple(map(tuple, found))

    @cached_property
    def initial(self) -> Marking:
        """The initial marking."""
        return tuple(n for n, place in enumerate(self.places) for _ in range(place.tokens))

    def enabled(self, marking: Marking) -> list[int]:
        """Return the transitions that have their tokens, in the order of the document.

        One that takes from no place is never among them, as in PNP.
        """
        # Only transitions behind a marked place, rather than all of the net.
        marked = set(marking)
        candidates = {t for place in marked for t in self.consumers[place]}
        # One token in each place is enough for most transitions; tokens are counted for the others.
        found = [t for t in candidates if self._needs[t] <= marked]
        if self._heavy:
            found = [t for t in found if t not in self._heavy or self.has_tokens(marking, t)]
        found.sort()
        return found

    @cached_property
    def _needs(self) -> tuple[frozenset[int], ...]:
        """For each transition: the places that it takes from."""
        return tuple(frozenset(place for place, _ in pairs) for pairs in self.inputs)

    @cached_property
    def _heavy(self) -> frozenset[int]:
        """Transitions that take more than one token from a place."""
        return frozenset(t for t, pairs in enumerate(self.inputs) if any(w > 1 for _, w in pairs))

    def has_tokens(self, marking: Marking, transition: int) -> bool:
        """Return whether the places that a transition takes from hold enough tokens."""
        return all(
            place in marking if weight == 1 else marking.count(place) >= weight
            for place, weight in self.inputs[transition]
        )

    def fire(self, marking: Marking, transition: int) -> Marking:
        """Return the marking after a transition that has its tokens."""
        # The result stays sorted: equal markings must be equal tuples, as they are keys of dicts.
        tokens = list(marking)
        for place, weight in self.inputs[transition]:
            for _ in range(weight):
                tokens.remove(place)
        for place, weight in self.outputs[transition]:
            for _ in range(weight):
                insort(tokens, place)
        return tuple(tokens)

    def words(self, marking: Marking) -> str:
        """Return a marking as text: "{ready, item (2 tokens)}"."""
        return "{" + ", ".join(self._counted(marking)) + "}"

    def _counted(self, marking: Marking) -> Iterator[str]:
        for place, count in Counter(marking).items():
            name = self.name_of(place)
            yield name if count == 1 else f"{name} ({count} tokens)"

    def name_of(self, place: int) -> str:
        """Return the label of a place, or its id if it has none."""
        node = self.places[place]
        return node.name.strip() or node.id

    def transition_name(self, transition: int) -> str:
        """Return the label of a transition, or its id if it has none."""
        node = self.transitions[transition]
        return node.name.strip() or node.id
