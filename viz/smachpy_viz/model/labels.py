"""Names, glyphs and texts for the pictures and the terminal."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

from smachpy.events.outcome_classes import outcome_class

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable

    from smachpy.events.introspection import StateRecord
    from smachpy.events.outcome_classes import OutcomeClass

LABEL_LENGTH = 40
# Not "printable" for Python, but part of words in Persian and Hindi, and of emoji.
_KEPT = frozenset("\u200c\u200d\n")
# Glyphs that both Liberation Sans and Arial have, so that no picture shows empty boxes.
GLYPHS = {"action": "\u25ba", "service": "\u2194", "monitor": "\u25cf", "condition": "?"}
KIND_WORDS = {
    "concurrence": "concurrent",
    "iterator": "repeats",
    "plan": "Petri net plan",
    "sequence": "sequence",
    "missing": "missing",
}
ENDINGS: dict[OutcomeClass, str] = {
    "success": "\u221a",
    "failure": "\u00d7",
    "preempted": "\u25a0",
    "other": "",
}

WATCHING = frozenset({"monitor", "condition"})
FINDINGS = frozenset({"invalid", "false", "no"})


def end_class(kind: str, outcome: str, success: Collection[str] | None = None) -> OutcomeClass:
    """Return the class of a state's outcome; a monitor's finding, even 'invalid', is no failure.

    Args:
        kind: The state's kind.
        outcome: The outcome.
        success: The state's good outcomes, if it says them (`StateRecord.success`).
    """
    if success is None and kind in WATCHING and outcome.lower() in FINDINGS:
        return "other"
    return outcome_class(outcome, success)


def cleanups(record: StateRecord) -> tuple[str, ...]:
    """Return the paths of the states that run at every end of what they are in."""
    return tuple(f"{one.path}/{one.cleanup}" for one in record.walk() if one.cleanup)


def tidies(path: str, among: Iterable[str]) -> bool:
    """Return whether a state is a clean-up, or in one.

    Args:
        path: Of the state.
        among: What `cleanups` returns.
    """
    return any(f"{path}/".startswith(f"{one}/") for one in among)


def one_line(text: str) -> str:
    """Return a text on one line; characters that cannot be printed become U+FFFD."""
    return visible(" ".join(text.split()))


def visible(text: str) -> str:
    """Return a text of the same length; characters that cannot be printed become U+FFFD.

    Control characters move a terminal's cursor, set its title and its clipboard; others change the
    order in which the text around them is read.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in _KEPT else "\ufffd" for c in text)


def shorten(text: str, length: int = LABEL_LENGTH) -> str:
    """Return `text` as one line of at most `length` printable characters."""
    line = one_line(text[: 4 * length])  # cut first: a value's text may have megabytes
    return line if len(line) <= length else line[: length - 1] + "\u2026"


def html_text(text: str) -> str:
    """Return a text for HTML and SVG: escaped, and without characters that cannot be printed."""
    return html.escape(visible(text))
