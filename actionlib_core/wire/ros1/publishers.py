"""Who publishes on a topic, from two sources that may overtake each other. No threads, no network.

The master tells all publishers of a topic in its answer to `registerSubscriber`, and again in a
`publisherUpdate` whenever they change. An update that arrives while the answer is on its way is
newer than it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


class Change(NamedTuple):
    """What a list of publishers means for our connections.

    Attributes:
        connect: Nodes to connect to, by their address.
        give_up: Nodes that publish no more: those that cannot be reached need no more trying.
    """

    connect: frozenset[str]
    give_up: frozenset[str]


class Publishers:
    """The publishers of one topic.

    Args:
        own: Our own address: a node does not listen to itself.

    Attributes:
        there: Addresses of the nodes that publish, as far as they were told.
    """

    def __init__(self, own: str) -> None:
        self._own = own
        self._updates = 0
        self.there: frozenset[str] = frozenset()

    def ask(self) -> int:
        """Note that the master is being asked; returns what to give `answer`."""
        return self._updates

    def answer(self, asked: int, addresses: Iterable[str]) -> Change:
        """Take the master's answer, unless an update has come since it was asked."""
        if asked != self._updates:
            return Change(frozenset(), frozenset())
        return self._take(addresses)

    def update(self, addresses: Iterable[str]) -> Change:
        """Take an update."""
        self._updates += 1
        return self._take(addresses)

    def _take(self, addresses: Iterable[str]) -> Change:
        before, self.there = self.there, frozenset(addresses) - {self._own}
        return Change(self.there - before, before - self.there)
