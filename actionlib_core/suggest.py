"""The hint of an error text that names what may have been meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def did_you_mean(word: object, known: Iterable[object], most: int = 1) -> str:
    """Return " Did you mean 'x' or 'y'?" for the nearest of `known`, "" when nothing is near.

    Args:
        word: What was given.
        known: What could have been.
        most: How many of them are shown.
    """
    shown = nearest(word, known, most)
    return f" Did you mean {' or '.join(map(repr, shown))}?" if shown else ""


def nearest(word: object, known: Iterable[object], most: int = 1) -> list[str]:
    """Return those of `known` that are most like `word`, at most `most`, the nearest first."""
    import difflib  # errors are rare, imports are not

    names, text = [str(name) for name in known], str(word)
    near = [name for name in names if name.lower() == text.lower()]
    near += difflib.get_close_matches(text, names, n=most, cutoff=0.5)
    return list(dict.fromkeys(near))[:most]
