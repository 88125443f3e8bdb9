"""What was seen lately."""

from __future__ import annotations


class Recent(dict[str, None]):
    """Words that were added; beyond the limit, those that came first are forgotten.

    A word that comes again keeps its place.
    """

    def __init__(self, limit: int) -> None:
        super().__init__()
        self._limit = limit

    def add(self, word: str) -> None:
        """Keep a word."""
        self[word] = None
        if len(self) > self._limit:
            del self[next(iter(self))]
