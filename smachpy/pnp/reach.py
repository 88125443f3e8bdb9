"""The markings that a net can reach if guards are ignored; no threads, time or I/O."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from smachpy.pnp.net import Marking, Net

MAX_MARKINGS: Final = 20_000
"""Limit of the search; the largest public plan has 3,555."""
_TOKENS_EACH: Final = 20
"""Average tokens of a marking; with more, the search ends earlier, as each marking takes longer."""


@dataclass(frozen=True)
class Reachable:
    """The reachable markings of a net.

    Attributes:
        net: The net.
        came: Marking -> the marking and the transition from which it was first reached; None for
            the initial one. In the order of a breadth-first search: nearest first.
        fired: Transitions that can fire.
        dead: Markings in which nothing can fire, nearest first.
        most: Place -> greatest number of its tokens; places that are never marked are not in it.
        covering: A marking, and a reachable one with the same tokens and more, which proves that
            the net is unbounded; None if no such pair was found.
        complete: Whether all markings were visited.
    """

    net: Net
    came: dict[Marking, tuple[Marking, int] | None]
    fired: frozenset[int]
    dead: tuple[Marking, ...]
    most: dict[int, int]
    covering: tuple[Marking, Marking] | None
    complete: bool

    def run_to(self, marking: Marking) -> tuple[int, ...]:
        """Return a shortest firing sequence that leads to a reachable marking."""
        run: list[int] = []
        step = self.came[marking]
        while step is not None:
            run.append(step[1])
            step = self.came[step[0]]
        return tuple(reversed(run))


def explore(net: Net, *, limit: int = MAX_MARKINGS) -> Reachable:
    """Find the reachable markings of `net`, breadth first.

    Args:
        net: The net.
        limit: Greatest number of markings to visit; the search also ends at the first proof that
            there are infinitely many.
    """
    came: dict[Marking, tuple[Marking, int] | None] = {net.initial: None}
    fired: set[int] = set()
    dead: list[Marking] = []
    most: dict[int, int] = dict(Counter(net.initial))
    covering = None
    queue = deque([net.initial])
    tokens = 0
    while queue and covering is None and len(came) <= limit and tokens <= limit * _TOKENS_EACH:
        marking = queue.popleft()
        tokens += len(marking)
        enabled = net.enabled(marking)
        if not enabled:
            dead.append(marking)
        for transition in enabled:
            after = net.fire(marking, transition)
            fired.add(transition)
            if after in came:  # reached before, by a run that is not longer
                continue
            came[after] = (marking, transition)
            queue.append(after)
            if len(set(after)) == len(after):
                for place, _ in net.outputs[transition]:
                    most.setdefault(place, 1)
                continue
            counts = Counter(after)
            for place, count in counts.items():
                if count > most.get(place, 0):
                    most[place] = count
            # Only markings with two tokens in one place: an unbounded net has such markings, and
            # the comparison with all markings on the way is slow.
            before = _covered(after, counts, came)
            if before is not None:
                covering = before, after
                break
    complete = not queue and covering is None
    return Reachable(net, came, frozenset(fired), tuple(dead), most, covering, complete)


def _covered(
    marking: Marking, counts: Counter[int], came: dict[Marking, tuple[Marking, int] | None]
) -> Marking | None:
    """Return a marking on the way to `marking` whose tokens are a proper part of its tokens."""
    step = came[marking]
    while step is not None:
        before = step[0]
        if len(before) < len(marking) and Counter(before) <= counts:
            return before
        step = came[before]
    return None
