"""Turns the model of a picture into boxes, dots and arrows with their looks.

Graphviz names are numbers (`n0`, `n0_in`, `n0_o1`), never the user's labels: the DOT text stays
valid whatever a state is called.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING

from smachpy_viz.pictures import style

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from smachpy_viz.model.machine import Diagram, Edge, Node, Pill, RulePicture
    from smachpy_viz.pictures.theme import Theme


BUNDLE_FROM = 6
"""Equal arrows to one outcome are told at the outcome if they are so many, as on the page."""

MANY = 7
"""Branches of a concurrence from which its arrows are told at the outcomes, as on the page."""

SURE = 0.995
"""A larger share is shown without a number: the arrow is practically always taken."""


@dataclass(frozen=True, slots=True)
class Vertex:
    """A small part of a container: its entry, an outcome or a join."""

    name: str
    attributes: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Anchor:
    """An end of an arrow.

    Attributes:
        box: Name of the box it is attached to.
        part: Name of the vertex in that box; "" for the box itself.
        is_open: Whether the box is an open container.
    """

    box: str
    part: str = ""
    is_open: bool = False


@dataclass(frozen=True, slots=True)
class Arrow:
    """One arrow between pieces of one container.

    Attributes:
        back: Points against the reading direction; layouts take it reversed.
    """

    name: str
    tail: Anchor
    head: Anchor
    attributes: Mapping[str, str]
    back: bool = False


@dataclass(frozen=True, slots=True)
class Box:
    """A state; if it has an entry, it is an open container with everything inside."""

    name: str
    attributes: Mapping[str, str]
    entry: Vertex | None = None
    pills: tuple[Vertex, ...] = ()
    joins: tuple[Vertex, ...] = ()
    boxes: tuple[Box, ...] = ()
    arrows: tuple[Arrow, ...] = ()

    def containers(self) -> Iterator[Box]:
        """Yield the open containers, parents first."""
        if self.entry is not None:
            yield self
        for box in self.boxes:
            yield from box.containers()

    def height(self) -> int:
        """Return the number of levels of open containers, this one included."""
        if self.entry is None:
            return 0
        return 1 + max((box.height() for box in self.boxes), default=0)


def shapes_of(diagram: Diagram, theme: Theme) -> Box:
    """Return the picture's boxes, dots and arrows."""
    numbers = count()

    def box_of(node: Node, depth: int) -> Box:
        name = f"n{next(numbers)}"
        if not node.is_open:
            return Box(name, style.state(node, diagram, theme))
        boxes = {child.label: box_of(child, depth + 1) for child in node.children}
        return _Interior(diagram, theme, node, depth, name, boxes).box()

    return box_of(diagram.root, 0)


class _Interior:
    """Builds the contents of one open container."""

    def __init__(
        self,
        diagram: Diagram,
        theme: Theme,
        node: Node,
        depth: int,
        name: str,
        boxes: Mapping[str, Box],
    ) -> None:
        self._diagram, self._marks, self._theme = diagram, diagram.marks, theme
        self._node, self._depth, self._name, self._boxes = node, depth, name, boxes
        self._nodes = {child.label: child for child in node.children}
        self._pills = {pill.outcome: f"{name}_o{i}" for i, pill in enumerate(node.pills)}
        self._joins: list[Vertex] = []
        self._decided: set[tuple[str, str, Anchor]] = set()
        self._arrows: list[Arrow] = []
        closed = all(box.entry is None for box in boxes.values())
        # Compared versions show each change, so all of their arrows.
        self._is_grid = (
            node.kind == "concurrence" and len(boxes) >= MANY and closed and not diagram.compared
        )
        self._bundled = self._bundles()

    def _bundles(self) -> dict[Edge, int]:
        """Return the transitions that are told at their outcome, with the size of their bundle."""
        node, taken = self._node, self._marks.taken
        if self._diagram.compared or node.kind in {"plan", "concurrence"}:
            return {}
        groups: dict[tuple[str, ...], list[Edge]] = {}
        for edge in node.edges:
            source = self._nodes[edge.source].path
            if (
                edge.to_outcome
                and not edge.note
                and not any(taken.get((source, o)) for o in edge.outcomes)
            ):
                groups.setdefault((edge.target, *edge.outcomes), []).append(edge)
        large = [group for group in groups.values() if len(group) >= BUNDLE_FROM]
        return {edge: len(group) for group in large for edge in group}

    def _told(self, outcome: str) -> str:
        """Return what is told at an outcome in place of arrows."""
        words = [
            f"from {n}" for n in {n: n for e, n in self._bundled.items() if e.target == outcome}
        ]
        if self._is_grid:
            sources = {
                edge.source
                for edge in self._node.edges
                if edge.to_outcome and edge.target == outcome
            }
            words += [f"any of {len(sources)}"] if sources else []
            words += [_rule_words(rule) for rule in self._node.rules if rule.outcome == outcome]
        return "; ".join(filter(None, words))

    def box(self) -> Box:
        if not self._is_grid:
            self._starts()
            for edge in self._node.edges:
                if edge not in self._bundled:
                    self._transition(edge)
            self._decisions()
        node, theme = self._node, self._theme
        visited = node.path in self._marks.visits
        entry = style.entry(theme, touched=visited or not self._marks.has_run)
        if node.kind == "plan":  # its tokens mark the start
            entry["style"] = "invis"
        return Box(
            self._name,
            style.container(node, self._depth, self._diagram, theme),
            Vertex(f"{self._name}_in", entry),
            tuple(self._pill(pill) for pill in node.pills),
            tuple(self._joins),
            tuple(self._boxes.values()),
            tuple(self._arrows),
        )

    def _pill(self, pill: Pill) -> Vertex:
        taken = self._marks.taken.get((self._node.path, pill.outcome), 0)
        faint = self._marks.has_run and not taken
        look = style.pill(
            pill.outcome,
            self._node,
            self._theme,
            by_default=pill.by_default,
            faint=faint,
            told=self._told(pill.outcome),
        )
        return Vertex(self._pills[pill.outcome], look)

    def _starts(self) -> None:
        fork = len(self._node.initial) > 1 or self._node.kind == "concurrence"
        for label in self._node.initial if self._node.kind != "plan" else ():
            self._arrow(
                Anchor(self._name, "in", is_open=True),
                self._entrance(label, back=False),
                style.start(self._theme, fork=fork),
            )

    def _transition(self, edge: Edge) -> None:
        source = self._boxes[edge.source]
        # An open container has a pill per outcome: each outcome gets an arrow of its own. A box has
        # one arrow for all of them.
        groups = [(outcome,) for outcome in edge.outcomes] if source.entry else [edge.outcomes]
        for outcomes in groups:
            path = self._nodes[edge.source].path
            same_name = edge.to_outcome and outcomes == (edge.target,)
            attributes = style.transition(
                outcomes,
                self._nodes[edge.source],
                self._theme,
                self._marks,
                counts={o: self._marks.taken.get((path, o), 0) for o in outcomes},
                labelled=source.entry is None and not same_name and any(outcomes),
                implicit=edge.implicit,
                change=edge.change if self._diagram.compared else None,
                remark=edge.note or self._share(path, outcomes),
            )
            head = (
                self._outcome(edge.target)
                if edge.to_outcome
                else self._entrance(edge.target, back=edge.back)
            )
            back = edge.back and edge.source != edge.target
            self._arrow(self._exit(edge.source, outcomes[0]), head, attributes, back=back)

    def _share(self, path: str, outcomes: Sequence[str]) -> str:
        """Return how often the counted runs took an arrow, in percent; "" for always or never."""
        share = self._marks.share(path, outcomes) if self._marks.runs else None
        return "" if share is None or not 0 < share < SURE else f"{share:.0%}"

    def _decisions(self) -> None:
        """Draw the rules: a bar where several states decide together, else a plain arrow."""
        for rule in self._node.rules:
            conditions = [pair for pair in rule.conditions if pair[0] in self._boxes]
            if rule.outcome not in self._pills:
                continue
            if not conditions:
                self._by_itself(rule)
            elif len({label for label, _ in conditions}) == 1 or rule.text.startswith("any of"):
                for label, outcome in conditions:
                    self._decide(label, outcome, self._outcome(rule.outcome), rule)
            else:
                self._join(rule, conditions)

    def _by_itself(self, rule: RulePicture) -> None:
        """Draw an outcome that no child decides, such as an iterator's without items."""
        self._arrow(
            Anchor(self._name, "in", is_open=True),
            self._outcome(rule.outcome),
            style.start(self._theme, fork=False) | {"label": style.note(rule.text, self._theme)},
        )

    def _join(self, rule: RulePicture, conditions: list[tuple[str, str]]) -> None:
        part = f"j{len(self._joins)}"
        self._joins.append(Vertex(f"{self._name}_{part}", style.join(rule.text, self._theme)))
        bar = Anchor(self._name, part, is_open=True)
        for label, outcome in conditions:
            self._decide(label, outcome, bar, rule)
        decision = dict(self._deciding(self._node, rule.outcome, rule, named=False))
        quorum = rule.text.partition(" of ")[0]
        if quorum.isdecimal():
            decision["label"] = style.note(f"{quorum} of {len(conditions)}", self._theme)
        self._arrow(bar, self._outcome(rule.outcome), decision)

    def _decide(self, label: str, child_outcome: str, head: Anchor, rule: RulePicture) -> None:
        named = self._boxes[label].entry is None and child_outcome != rule.outcome
        if (label, child_outcome, head) not in self._decided:
            self._decided.add((label, child_outcome, head))
            attributes = self._deciding(self._nodes[label], child_outcome, rule, named=named)
            self._arrow(self._exit(label, child_outcome), head, attributes)

    def _deciding(
        self, node: Node, outcome: str, rule: RulePicture, *, named: bool
    ) -> Mapping[str, str]:
        return style.transition(
            [outcome],
            node,
            self._theme,
            self._marks,
            counts={outcome: self._marks.taken.get((node.path, outcome), 0)},
            labelled=named,
            implicit=False,
            change=rule.change if self._diagram.compared else None,
        )

    def _exit(self, label: str, outcome: str) -> Anchor:
        box = self._boxes[label]
        if box.entry is None:
            return Anchor(box.name)
        pills = [pill.outcome for pill in self._nodes[label].pills]
        if outcome not in pills:
            return Anchor(box.name, "", is_open=True)
        return Anchor(box.name, f"o{pills.index(outcome)}", is_open=True)

    def _entrance(self, label: str, *, back: bool) -> Anchor:
        box = self._boxes[label]
        if box.entry is None:
            return Anchor(box.name)
        return Anchor(box.name, "" if back else "in", is_open=True)

    def _outcome(self, outcome: str) -> Anchor:
        part = self._pills[outcome].removeprefix(f"{self._name}_")
        return Anchor(self._name, part, is_open=True)

    def _arrow(
        self, tail: Anchor, head: Anchor, attributes: Mapping[str, str], *, back: bool = False
    ) -> None:
        name = f"{self._name}_e{len(self._arrows)}"
        self._arrows.append(Arrow(name, tail, head, attributes, back))


def _rule_words(rule: RulePicture) -> str:
    """Return a rule of a grid in a few words: "all 30", "20 of 30", "any of 30", "A: done"."""
    labels = {label for label, _ in rule.conditions}
    quorum = rule.text.partition(" of ")[0]
    if len(labels) == 1:
        return "; ".join(f"{label}: {outcome}" for label, outcome in rule.conditions[:1])
    if quorum == "any" or quorum.isdecimal():
        return f"{quorum} of {len(labels)}"
    return f"all {len(labels)}" if labels else rule.text
