"""The publishers of a topic, from two sources that may overtake each other. No threads, no network.

The master lists all publishers of a topic in its answer to `registerSubscriber`, and again in a
`publisherUpdate` whenever they change. An update that arrives before the answer is newer than the
answer.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


MAX_PUBLISHERS: Final = 100
"""Publishers of one topic that we connect to; each has a thread."""


class Change(NamedTuple):
    """What to do with our connections after a new list of publishers.

    Attributes:
        connect: Addresses of nodes to connect to.
        give_up: Addresses of nodes that no longer publish: attempts to connect to them end.
        left_out: Number of further addresses, to which we do not connect.
    """

    connect: frozenset[str]
    give_up: frozenset[str]
    left_out: int = 0


class Publishers:
    """The publishers of one topic.

    Args:
        own: Our own address: a node does not subscribe to itself.

    Attributes:
        there: Addresses of the nodes that publish, from the newest list.
    """

    def __init__(self, own: str) -> None:
        self._own = own
        self._updates = 0
        self.there: frozenset[str] = frozenset()

    def ask(self) -> int:
        """Note that the master is being asked; return the first argument of `answer`."""
        return self._updates

    def answer(self, asked: int, addresses: Iterable[str]) -> Change:
        """Handle the master's answer, unless an update has arrived since it was asked."""
        if asked != self._updates:
            return Change(frozenset(), frozenset())
        return self._take(addresses)

    def update(self, addresses: Iterable[str]) -> Change:
        """Handle an update."""
        self._updates += 1
        return self._take(addresses)

    def _take(self, addresses: Iterable[str]) -> Change:
        before = self.there
        named = dict.fromkeys(addresses)
        named.pop(self._own, None)
        # Those that we know come first: a list that anybody can send must not push them out.
        ordered = sorted(named, key=lambda address: address not in before)
        self.there = frozenset(islice(ordered, MAX_PUBLISHERS))
        left_out = len(named) - len(self.there)
        return Change(self.there - before, before - self.there, left_out)
