"""Writes a picture as Mermaid text (`stateDiagram-v2`), for READMEs and issue threads."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from smachpy_viz.model.labels import KIND_WORDS, shorten

if TYPE_CHECKING:
    from collections.abc import Iterator

    from smachpy_viz.model.machine import Diagram, Node
    from smachpy_viz.pictures.theme import Theme

# Characters with a meaning in Mermaid become its own numeric escapes.
_ESCAPES = {ord(c): f"#{ord(c)};" for c in '"#;:<>&{}[]()|%\\`*~'}


def mermaid_text(diagram: Diagram, theme: Theme) -> str:
    """Return the picture as Mermaid text; a container's outcomes are states at its end."""
    return "\n".join(_MermaidWriter(diagram, theme).lines()) + "\n"


class _MermaidWriter:
    def __init__(self, diagram: Diagram, theme: Theme) -> None:
        self._diagram = diagram
        self._theme = theme
        self._numbers = count()
        self._names: dict[str, str] = {}
        self._active: list[str] = []

    def lines(self) -> Iterator[str]:
        swatch = self._theme.active
        yield "stateDiagram-v2"
        yield from self._state(self._diagram.root, "  ")
        if self._active:
            yield (
                f"  classDef active fill:{swatch.fill},stroke:{swatch.stroke},color:{swatch.text}"
            )
            yield f"  class {','.join(self._active)} active"

    def _state(self, node: Node, pad: str) -> Iterator[str]:
        name = self._names[node.path] = f"s{next(self._numbers)}"
        if node.path in self._diagram.marks.active and not node.is_open:
            self._active.append(name)
        note = f" ({node.hidden} states)" if node.hidden else ""
        word = f" ({KIND_WORDS[node.kind]})" if node.is_open and node.kind in KIND_WORDS else ""
        title = _text(node.label + note + word)
        if not node.is_open:
            yield f'{pad}state "{title}" as {name}'
            return
        yield f'{pad}state "{title}" as {name} {{'
        yield from self._inside(node, name, pad + "  ")
        yield f"{pad}}}"

    def _inside(self, node: Node, name: str, pad: str) -> Iterator[str]:
        for child in node.children:
            yield from self._state(child, pad)
        names = {child.label: self._names[child.path] for child in node.children}
        ends = {pill.outcome: f"{name}_o{i}" for i, pill in enumerate(node.pills)}
        for outcome, end in ends.items():
            yield f'{pad}state "{_text(outcome)}" as {end}'
        for label in node.initial:
            yield f"{pad}[*] --> {names[label]}"
        for edge in node.edges:
            target = ends[edge.target] if edge.to_outcome else names[edge.target]
            label = _text(" ".join(filter(None, (" / ".join(edge.outcomes), edge.note))))
            yield f"{pad}{names[edge.source]} --> {target} : {label}"
        for rule in node.rules:
            for label, outcome in rule.conditions:
                if label in names and rule.outcome in ends:
                    yield f"{pad}{names[label]} --> {ends[rule.outcome]} : {_text(outcome)}"


def _text(text: str) -> str:
    return shorten(text).translate(_ESCAPES) or "\u00a0"  # Mermaid refuses empty names
