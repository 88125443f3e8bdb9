"""All sequences of choices, those with the fewest unusual ones first."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable


@dataclass(frozen=True, slots=True)
class Choice:
    """One choice of a run.

    Attributes:
        where: What was chosen at: a state's path, a server, or "turn".
        options: What there was to choose from; the first is the usual one.
        picked: Index of what was chosen.
        situation: Equal in two runs when all that can follow is equal; None: never.
    """

    where: str
    options: tuple[str, ...]
    picked: int
    situation: Hashable = None

    def __str__(self) -> str:
        return f"{self.where}: {self.options[self.picked]}"


class Search:
    """Which runs to try next: each is given the choices it begins with, the rest is as usual.

    Runs come in the order of the number of their unusual choices, so the first run that fails is
    among the simplest that do.

    Args:
        depth: Choices after the `depth`-th of a run are not varied.

    Attributes:
        is_cut: There were choices after the `depth`-th.
    """

    def __init__(self, depth: float) -> None:
        self._depth = depth
        self._waiting: deque[tuple[int, ...]] = deque([()])
        self._seen: set[Hashable] = set()
        self.is_cut = False

    def next(self) -> tuple[int, ...] | None:
        """Return the choices that the next run begins with; None when all were tried."""
        return self._waiting.popleft() if self._waiting else None

    def add(self, prefix: tuple[int, ...], choices: list[Choice]) -> None:
        """Queue the runs that choose otherwise than one that has ended.

        Args:
            prefix: The choices that `next` gave for it.
            choices: All its choices, in order.
        """
        picks = tuple(choice.picked for choice in choices)
        for number in range(len(prefix), len(choices)):
            choice = choices[number]
            if choice.situation is not None:
                if choice.situation in self._seen:
                    return  # another run went on from here in the same way
                self._seen.add(choice.situation)
            if number >= self._depth:
                self.is_cut = True
                return
            self._waiting.extend(
                (*picks[:number], other)
                for other in range(len(choice.options))
                if other != choice.picked
            )
