"""The "Did you mean ...?" of error texts."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable


MAX_KNOWN_WORDS: Final = 300
"""Known words that are compared: the first ones."""

MAX_WORD_LENGTH: Final = 100
"""Longest word that is compared [characters]."""


def did_you_mean(word: object, known: Iterable[object], most: int = 1) -> str:
    """Return " Did you mean 'x' or 'y'?" with the most similar of `known`; "" if none is similar.

    Args:
        word: The unknown word.
        known: The known words.
        most: Largest number of suggestions.
    """
    shown = nearest(word, known, most)
    return f" Did you mean {' or '.join(map(repr, shown))}?" if shown else ""


def nearest(word: object, known: Iterable[object], most: int = 1) -> list[str]:
    """Return the words of `known` that are most similar to `word`, at most `most` of them."""
    import difflib  # here, as only errors need it

    # Comparing takes time, also for words of a long file that somebody else has written.
    names = [str(name) for name in islice(known, MAX_KNOWN_WORDS)]
    names, text = (
        [name for name in names if len(name) <= MAX_WORD_LENGTH],
        str(word)[:MAX_WORD_LENGTH],
    )
    near = [name for name in names if name.lower() == text.lower()]
    near += difflib.get_close_matches(text, names, n=most, cutoff=0.5)
    return list(dict.fromkeys(near))[:most]
