"""The "Did you mean ...?" of error texts."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


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

    names, text = [str(name) for name in known], str(word)
    near = [name for name in names if name.lower() == text.lower()]
    near += difflib.get_close_matches(text, names, n=most, cutoff=0.5)
    return list(dict.fromkeys(near))[:most]
