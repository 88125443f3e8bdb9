"""Enumerates sequences of choices, those with the fewest unusual ones first."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable


@dataclass(frozen=True, slots=True)
class ScheduleChoice:
    """One choice of a run.

    Attributes:
        where: The place of the choice: a state's path, a server, or "turn".
        options: The options; the first is the usual one.
        picked: Index of the option that was picked.
        situation: Equal in two runs if everything that can follow is equal; None: never equal.
    """

    where: str
    options: tuple[str, ...]
    picked: int
    situation: Hashable = None

    def __str__(self) -> str:
        return f"{self.where}: {self.options[self.picked]}"


class Search:
    """Decides which runs come next; each gets its first choices, the others are the usual ones.

    Runs are ordered by the number of their unusual choices, so the first run that fails is among
    the simplest that do.

    Args:
        depth: Choices of a run after this many are not varied.

    Attributes:
        is_cut: Whether there were choices after `depth`.
    """

    def __init__(self, depth: float) -> None:
        self._depth = depth
        self._waiting: deque[tuple[int, ...]] = deque([()])
        self._seen: set[Hashable] = set()
        self.is_cut = False

    def next(self) -> tuple[int, ...] | None:
        """Return the first choices of the next run; None if all were tried."""
        return self._waiting.popleft() if self._waiting else None

    def waiting(self, skipped: int, most: int) -> list[tuple[int, ...]]:
        """Return the first choices of the runs that `next` will return, without taking them.

        Args:
            skipped: Leave out so many.
            most: Return so many at most.
        """
        return list(islice(self._waiting, skipped, skipped + most))

    def add(self, prefix: tuple[int, ...], choices: list[ScheduleChoice]) -> None:
        """Queue the runs that differ from a finished one by one more choice.

        Args:
            prefix: The choices that `next` returned for it.
            choices: All its choices, in order.
        """
        # Only choices after the prefix: those within it were varied when shorter runs were added,
        # so no sequence is queued twice.
        picks = tuple(choice.picked for choice in choices)
        for number in range(len(prefix), len(choices)):
            choice = choices[number]
            if choice.situation is not None:
                if choice.situation in self._seen:
                    return  # another run has continued from an equal situation
                self._seen.add(choice.situation)
            if number >= self._depth:
                self.is_cut = True
                return
            self._waiting.extend(
                (*picks[:number], other)
                for other in range(len(choice.options))
                if other != choice.picked
            )
