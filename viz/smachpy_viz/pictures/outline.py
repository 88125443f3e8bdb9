"""Writes a picture as lines of text: the tree of states and their transitions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from smachpy_viz.model.labels import GLYPHS, KIND_WORDS, shorten

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy_viz.model.machine import Diagram, Marks, Node

RUNNING = "\u25b8"
"""Marks a state that is running."""
DOT = "\u25cf"
"""A token of a place."""

MAX_DOTS = 3


def outline_text(diagram: Diagram) -> str:
    """Return the picture as an indented tree.

    A state's line lists its outcomes and their targets; an asterisk marks the first state of a
    container, a triangle a running state.
    """
    return "\n".join(_lines(diagram.root, diagram.marks, "", "", first=False, exits="")) + "\n"


def _lines(
    node: Node, marks: Marks, lead: str, rest: str, *, first: bool, exits: str
) -> Iterator[str]:
    yield lead + _title(node, marks, first=first) + (f"  {exits}" if exits else "")
    ways = _exits(node)
    for i, child in enumerate(node.children):
        last = i == len(node.children) - 1 and not node.rules
        yield from _lines(
            child,
            marks,
            rest + ("\u2514\u2500 " if last else "\u251c\u2500 "),
            rest + ("   " if last else "\u2502  "),
            first=child.label in node.initial,
            exits=ways.get(child.label, ""),
        )
    for i, rule in enumerate(node.rules):
        corner = "\u2514\u2500 " if i == len(node.rules) - 1 else "\u251c\u2500 "
        words = rule.text or " and ".join(f"{label}:{oc}" for label, oc in rule.conditions)
        yield f"{rest}{corner}{shorten(rule.outcome)} \u2190 {shorten(words, 120)}"


def _title(node: Node, marks: Marks, *, first: bool) -> str:
    glyph = GLYPHS.get(node.kind, "")
    word = KIND_WORDS.get(node.kind, "")
    count = marks.visits.get(node.path, 0)
    parts = [
        RUNNING if node.path in marks.active else "",
        "*" if first else "",
        glyph,
        shorten(node.caption or node.label),
        DOT * min(node.tokens, MAX_DOTS),
        f"({word})" if word else "",
        f"(+{node.hidden} states)" if node.hidden else "",
        f"\u00d7{count}" if count > 1 else "",
        f"[{shorten(marks.last[node.path])}]" if node.path in marks.last else "",
    ]
    return " ".join(part for part in parts if part)


def _exits(parent: Node) -> dict[str, str]:
    """Return, by the label of each child, the outcomes with their targets."""
    names = {child.label: child.caption or child.label for child in parent.children}
    exits: dict[str, list[str]] = {}
    for edge in parent.edges:
        by = " ".join(filter(None, ("/".join(edge.outcomes), edge.note)))
        to = names.get(edge.target, edge.target)
        exits.setdefault(edge.source, []).append(f"{shorten(by)} \u2192 {shorten(to)}".lstrip())
    return {label: ", ".join(ways) for label, ways in exits.items()}
