"""Builds the model of a picture from a machine's introspection record."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from actionlib_core.inputs.suggest import nearest
from smachpy.events.outcome_classes import is_good
from smachpy.exceptions import SmachError
from smachpy_viz.model.machine import MISSING, PLACE, TRANSITION, Edge, Node, Pill, RulePicture

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from smachpy.events.introspection import NetTransitionRecord, StateRecord, TransitionRecord

READABLE = 60
"""The most states that a picture shows if no depth is given."""


class UnknownPathError(SmachError):
    """No state has this path.

    Try: use one of the paths that the error lists.

    Attributes:
        path: The path that was asked for.
    """

    def __init__(self, path: str, paths: Sequence[str]) -> None:
        self.path = path
        near = nearest(path, paths, 3) or list(paths[:5])
        super().__init__(
            f"picture: no state {path!r}; expected a path such as {', '.join(map(repr, near))}."
        )


def find(record: StateRecord, path: str) -> StateRecord:
    """Return the record at `path`; the name of the root may be left out.

    Raises:
        UnknownPathError: there is none.
    """
    wanted = "/" + path.strip("/")
    for candidate in record.walk():
        if candidate.path in {wanted, record.path.rstrip("/") + wanted}:
            return candidate
    raise UnknownPathError(path, [candidate.path for candidate in record.walk()])


def readable_depth(record: StateRecord) -> int:
    """Return the greatest depth at which at most `READABLE` states are visible, at least 1."""
    level: list[StateRecord] = [record]
    visible = depth = 0
    while level:
        visible += len(level)
        if visible > READABLE and depth > 1:
            break
        depth += 1
        level = [child for state in level for child in state.children]
    return max(depth - 1, 1)


def extract(record: StateRecord, *, depth: int | None = None, show_implicit: bool = False) -> Node:
    """Return the model of a picture of `record`.

    Args:
        record: The machine, or any part of it.
        depth: Number of container levels to open; None opens as many as stay readable.
        show_implicit: Also draw transitions that nobody wrote down. Otherwise only those of
                successful outcomes are drawn: those of failure and preemption would hide the rest.
    """
    levels = readable_depth(record) if depth is None else depth
    return _node(record, levels, frozenset(record.outcomes), show_implicit=show_implicit)


def _node(record: StateRecord, levels: int, wired: frozenset[str], *, show_implicit: bool) -> Node:
    if record.net is not None and levels > 0:
        return _net_node(record, levels, show_implicit=show_implicit)
    if levels <= 0 or not record.children:
        return _closed(record)
    labels = {child.label for child in record.children}
    shown = [
        _checked(t, record, labels)
        for t in record.transitions
        if t.source in labels and (show_implicit or _is_drawn(t))
    ]
    edges = _edges(record, shown)
    uses = _outcomes_used(record, shown)
    children = tuple(
        _node(child, levels - 1, uses.get(child.label, frozenset()), show_implicit=show_implicit)
        for child in record.children
    )
    children = tuple(
        replace(child, note="at any end") if child.label == record.cleanup else child
        for child in children
    )
    return replace(
        _box(record),
        children=children + _missing(record, edges, labels),
        initial=record.initial,
        edges=edges,
        rules=tuple(RulePicture(r.outcome, r.conditions, r.text) for r in record.rules),
        default_outcome=record.default_outcome,
        pills=_pills(record, edges, wired),
    )


def _net_node(record: StateRecord, levels: int, *, show_implicit: bool) -> Node:
    """Return a plan as its net. An exec place is drawn as the box of its action.

    An action with several exec places is drawn at each of them: the first box is the action
    itself, the others are closed copies with its name as caption.
    """
    net = record.net
    assert net is not None
    made = {
        child.label: _node(child, levels - 1, frozenset(), show_implicit=show_implicit)
        for child in record.children
    }
    names: dict[str, str] = {}
    nodes: list[Node] = []
    taken = set(made)
    for place in net.places:
        child = made.pop(place.child, None)
        if child is not None:
            names[place.id] = child.label
            nodes.append(child)
            continue
        names[place.id] = label = _free(place.id, taken)
        closed = next((c for c in record.children if c.label == place.child), None)
        if closed is not None:  # the same action, once more
            nodes.append(replace(_closed(closed), label=label, caption=closed.label))
        else:
            kind = PLACE if place.role == "place" else f"{place.role} place"
            path = f"{record.path}/{label}"
            details = (("tokens", str(place.tokens)),) if place.tokens else ()
            nodes.append(
                Node(path, label, kind, details=details, caption=place.name, tokens=place.tokens)
            )
    nodes += made.values()  # actions that no place runs
    arrows: list[tuple[str, str, str]] = []
    for transition in net.transitions:
        label = _free(transition.id, taken)
        caption = _transition_caption(transition)
        shown = transition.name or transition.id
        nodes.append(Node(f"{record.path}/{label}", label, TRANSITION, caption=shown))
        inward = [_weight(weight) for _, weight in transition.inputs]
        if inward:  # the transition's text is the label of its first incoming arrow
            inward[0] = " ".join(text for text in (caption, inward[0]) if text)
        into = zip(transition.inputs, inward, strict=True)
        arrows += [(names[place], label, text) for (place, _), text in into]
        arrows += [(label, names[p], _weight(weight)) for p, weight in transition.outputs]
    starts = [names[place.id] for place in net.places if place.tokens]
    order = [*starts, *(node.label for node in nodes)]
    backward = _backward(order, [(source, target) for source, target, _ in arrows])
    return replace(
        _box(record),
        children=tuple(nodes),
        initial=tuple(starts),
        edges=tuple(
            Edge(source, target, False, (text,), back=(source, target) in backward)  # noqa: FBT003
            for source, target, text in arrows
        ),
    )


def _free(name: str, taken: set[str]) -> str:
    """Return `name`, with primes appended while another node has that name already."""
    while name in taken:
        name += "\u2032"
    taken.add(name)
    return name


def _weight(weight: int) -> str:
    return "" if weight == 1 else str(weight)


def _transition_caption(transition: NetTransitionRecord) -> str:
    """Return a transition's text: its calls except start and end, and its guard."""
    words = [] if transition.calls else [transition.name.partition("[")[0].strip()]
    words += [what for _, what in transition.calls if what not in {"start", "end"}]
    guard = f"[{transition.guard}]" if transition.guard else ""
    return " ".join(word for word in (*words, guard) if word)


def _checked(
    transition: TransitionRecord, record: StateRecord, labels: Collection[str]
) -> TransitionRecord:
    """Return the transition with `target_is_outcome` corrected.

    A target that is neither a state nor an outcome counts as a missing state, so that an
    inconsistent machine can be drawn.
    """
    is_outcome = transition.target in record.outcomes and (
        transition.target_is_outcome or transition.target not in labels
    )
    return replace(transition, target_is_outcome=is_outcome)


def _missing(
    record: StateRecord, edges: Iterable[Edge], labels: Collection[str]
) -> tuple[Node, ...]:
    """Return nodes for the states that are targets but do not exist."""
    targets = [edge.target for edge in edges if not edge.to_outcome]
    names = dict.fromkeys(name for name in (*record.initial, *targets) if name not in labels)
    return tuple(Node(f"{record.path}/{name}", name, MISSING) for name in names)


def _closed(record: StateRecord) -> Node:
    return replace(_box(record), hidden=sum(1 for _ in record.walk()) - 1)


def _box(record: StateRecord) -> Node:
    """Return the node of a state, without what is inside."""
    return Node(
        path=record.path,
        label=record.label,
        kind=record.kind,
        type_name=record.type_name,
        doc=record.doc,
        details=record.details,
        outcomes=record.outcomes,
        success=record.success,
    )


def _is_drawn(transition: TransitionRecord) -> bool:
    """Return whether a transition is drawn without `show_implicit`."""
    if not transition.implicit:
        return True
    return is_good(transition.outcome)


def _edges(record: StateRecord, transitions: Iterable[TransitionRecord]) -> tuple[Edge, ...]:
    """Return the edges: outcomes of one state with one target share an edge."""
    merged: dict[tuple[str, str, bool, bool, str], list[str]] = {}
    for t in transitions:
        key = (t.source, t.target, t.target_is_outcome, t.implicit, t.guard)
        merged.setdefault(key, []).append(t.outcome)
    order = (*record.initial, *(child.label for child in record.children))
    backward = _backward(order, [(s, t) for s, t, is_outcome, *_ in merged if not is_outcome])
    return tuple(
        Edge(
            source,
            target,
            to_outcome,
            tuple(outcomes),
            implicit,
            back=(source, target) in backward,
            note=f"[{guard}]" if guard else "",
        )
        for (source, target, to_outcome, implicit, guard), outcomes in merged.items()
    )


def _backward(
    order: Iterable[str], arrows: Sequence[tuple[str, str]]
) -> frozenset[tuple[str, str]]:
    """Return the arrows that close a loop, in the reading order that `order` starts.

    A depth-first search, with a stack of its own: a machine with 1,000 states in a row would
    exceed Python's recursion limit.
    """
    following: dict[str, list[str]] = {}
    for tail, head in arrows:
        following.setdefault(tail, []).append(head)
    found: set[tuple[str, str]] = set()
    done: set[str] = set()
    for start in order:
        if start in done:
            continue
        trail = {
            start
        }  # the states on the way from `start` to `here`: an arrow to one of them is back
        stack = [(start, iter(following.get(start, ())))]
        while stack:
            here, ahead = stack[-1]
            target = next(ahead, None)
            if target is None:
                stack.pop()
                trail.discard(here)
                done.add(here)
            elif target in trail:
                found.add((here, target))
            elif target not in done:
                trail.add(target)
                stack.append((target, iter(following.get(target, ()))))
    return frozenset(found)


def _outcomes_used(
    record: StateRecord, shown: Iterable[TransitionRecord]
) -> dict[str, frozenset[str]]:
    """Return, by child, the outcomes at which an arrow starts."""
    pairs = [(t.source, t.outcome) for t in shown]
    pairs += [pair for rule in record.rules for pair in rule.conditions]
    uses: dict[str, set[str]] = {}
    for label, outcome in pairs:
        uses.setdefault(label, set()).add(outcome)
    return {label: frozenset(outcomes) for label, outcomes in uses.items()}


def _pills(record: StateRecord, edges: Sequence[Edge], wired: frozenset[str]) -> tuple[Pill, ...]:
    # An outcome at which an arrow ends or starts gets a pill; one that only implicit transitions
    # lead to is drawn dashed.
    written = Counter(edge.target for edge in edges if edge.to_outcome and not edge.implicit)
    written.update(rule.outcome for rule in record.rules)
    drawn = {edge.target for edge in edges if edge.to_outcome}
    return tuple(
        Pill(outcome, by_default=not written[outcome])
        for outcome in record.outcomes
        if written[outcome] or outcome in drawn or outcome in wired
    )
