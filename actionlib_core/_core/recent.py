"""What was seen lately."""

from __future__ import annotations


class Recent:
    """Words that were added; beyond the limit, those that came first are forgotten.

    A word that comes again keeps its place.
    """

    __slots__ = ("_limit", "_words")

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._words: dict[str, None] = {}

    def add(self, word: str) -> None:
        """Keep a word."""
        self._words[word] = None
        if len(self._words) > self._limit:
            del self._words[next(iter(self._words))]

    def __contains__(self, word: str) -> bool:
        return word in self._words
