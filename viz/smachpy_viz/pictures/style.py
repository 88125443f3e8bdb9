"""The look of each part of a picture, as Graphviz attributes.

Every text from a machine passes through `shorten`, `markup` or `plain` here, so that no name can
break a picture.
"""

from __future__ import annotations

import re
from math import log2
from string import punctuation
from typing import TYPE_CHECKING

import graphviz

from smachpy.events.outcome_classes import outcome_class
from smachpy_viz.model.labels import ENDINGS, GLYPHS, KIND_WORDS, end_class, shorten
from smachpy_viz.model.machine import MISSING, PLACE, TRANSITION
from smachpy_viz.pictures.theme import FONT

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from smachpy.events.outcome_classes import OutcomeClass
    from smachpy_viz.model.machine import Diagram, Marks, Node
    from smachpy_viz.pictures.theme import Swatch, Theme

    Attributes = dict[str, str]

TOOLTIP_LENGTH = 600
MAX_DOTS = 3  # more tokens are shown as a number
SIGNS = {"added": "+", "removed": "\u2212", "changed": "\u2260"}
"""The sign before a changed name: colour alone is not enough."""

# Graphviz' HTML parser fails on more than XML's five characters, for example on "]".
_ENTITIES = {ord(mark): f"&#{ord(mark)};" for mark in punctuation if mark not in "_-."}
_BACKSLASH = re.compile(r"\\(?=[\w\\])")


def markup(text: str) -> str:
    """Return `text` safe inside an HTML-like label."""
    return _inert(shorten(text)).translate(_ENTITIES) or " "


def plain(text: str, length: int = TOOLTIP_LENGTH) -> str:
    """Return `text` safe as the value of an ordinary attribute."""
    lines = [shorten(line, length) for line in text[: 4 * length].splitlines()[:12]]
    escaped = [graphviz.escape(_inert(line).replace("&", "&amp;")) for line in lines]
    safe: str = graphviz.nohtml("\\n".join(escaped))
    return safe


def _inert(text: str) -> str:
    """Put a zero-width space between a backslash and a letter.

    Graphviz replaces a backslash followed by N, G and other letters with names of its own, even if
    the backslash is escaped, because it expands the text more than once.
    """
    return _BACKSLASH.sub("\\\\\u200b", text)


def graph(theme: Theme) -> Attributes:
    """Return the attributes of the whole picture."""
    return {
        "bgcolor": theme.background,
        "compound": "true",
        "fontcolor": theme.ink,
        "fontname": FONT,
        "fontsize": "11",
        "labeljust": "l",
        "margin": "0",
        "nodesep": "0.26",
        "notranslate": "true",
        "pad": "0.25",
        "ranksep": "0.34",
        "splines": "true",
        "outputorder": "edgesfirst",
        "tooltip": " ",
    }


def node_defaults(theme: Theme) -> Attributes:
    """Return the default attributes of nodes."""
    return {
        "color": theme.inactive.stroke,
        "fillcolor": theme.inactive.fill,
        "fontcolor": theme.inactive.text,
        "fontname": FONT,
        "fontsize": "11",
        "height": "0.34",
        "margin": "0.14,0.05",
        "penwidth": "1.1",
        "shape": "box",
        "style": "rounded,filled",
        "width": "0.5",
    }


def edge_defaults(theme: Theme) -> Attributes:
    """Return the default attributes of edges."""
    return {
        "arrowsize": "0.62",
        "color": theme.edge,
        "fontcolor": theme.muted,
        "fontname": FONT,
        "fontsize": "9",
        "penwidth": "1.2",
        "tooltip": " ",
    }


def state(node: Node, diagram: Diagram, theme: Theme) -> Attributes:
    """Return the look of a leaf or a closed container."""
    marks = diagram.marks
    if node.kind == TRANSITION:
        return {**_identity(node, diagram), **_net_transition(node, theme)}
    if node.kind.endswith(PLACE):
        return {**_identity(node, diagram), **_place(node, theme)}
    attributes = {**_identity(node, diagram), "label": _state_label(node, marks, theme)}
    if node.hidden:
        attributes["peripheries"] = "2"
    if diagram.compared:
        return attributes | _compared(node, theme)
    swatch, extra = _status(node, marks, theme)
    return attributes | _swatch(swatch) | extra | _heated(node, marks, theme)


def _place(node: Node, theme: Theme) -> Attributes:
    """Return the look of a net's place: name and tokens; goal and fail places are coloured."""
    swatch = {
        "goal place": theme.outcome("success"),
        "fail place": theme.outcome("failure"),
    }.get(node.kind, theme.inactive)
    dots = "\u25cf" * node.tokens if node.tokens <= MAX_DOTS else f"\u25cf{node.tokens}"
    text = "&#160;".join(
        part for part in (markup(node.caption) if node.caption else "", dots) if part
    )
    return {
        "fontsize": "9",
        "height": "0.25",
        "label": f"<{text or ' '}>",
        "margin": "0.04,0.02",
        "penwidth": "1.2",
        "peripheries": "1" if node.kind == PLACE else "2",
        "shape": "ellipse",
        "style": "filled",
        "width": "0.25",
    } | _swatch(swatch)


def _net_transition(node: Node, theme: Theme) -> Attributes:
    """Return the look of a net's transition: a bar."""
    return {**join(node.caption, theme), "height": "0.07"}


def container(node: Node, depth: int, diagram: Diagram, theme: Theme) -> Attributes:
    """Return the look of an open container."""
    marks = diagram.marks
    active = node.path in marks.active
    word = KIND_WORDS.get(node.kind, "")
    title = f"{_sign(node, theme)}<b>{markup(node.label)}</b>"
    if word:
        title += f'<font point-size="9" color="{theme.muted}">&#160;&#160;{word}</font>'
    if not marks.notes:
        title += _count(marks.visits.get(node.path, 0), theme.muted)
    title += _note(node, marks, theme, before="&#160;&#160;")
    if depth == 0 and diagram.legend:
        title += f'<br align="left"/>{_legend(diagram, theme)}'
    changed = _change_line(node, theme) if node.change else {}
    return {
        **_identity(node, diagram),
        "color": theme.active.stroke if active else theme.border,
        "fillcolor": theme.container(depth),
        "fontcolor": theme.active.text if active else theme.ink,
        "label": f"<{title}>",
        "margin": "11",
        "penwidth": "2.2" if active else "1",
        "style": "rounded,filled,dashed" if node.kind == "concurrence" else "rounded,filled",
    } | changed


def entry(theme: Theme, *, touched: bool) -> Attributes:
    """Return the look of the dot at which a container is entered."""
    colour = theme.ink if touched else theme.muted
    return {
        "color": colour,
        "fillcolor": colour,
        "fixedsize": "true",
        "height": "0.11",
        "label": "",
        "shape": "circle",
        "style": "filled",
        "tooltip": "start",
        "width": "0.11",
    }


def pill(
    outcome: str, node: Node, theme: Theme, *, by_default: bool, faint: bool, told: str = ""
) -> Attributes:
    """Return the look of an outcome on the border of a container; `told` in place of arrows."""
    text = f"{outcome}, {told}" if told else outcome
    swatch = theme.outcome(outcome_class(outcome, node.success))
    attributes = {
        "fontsize": "9",
        "height": "0.21",
        "label": f"<{markup(text)}>",
        "margin": "0.1,0.02",
        "penwidth": "1.2",
        "style": "rounded,filled,dashed" if by_default else "rounded,filled",
        "tooltip": plain(f"outcome {outcome}"),
        "width": "0.3",
    } | _swatch(swatch)
    if faint:
        attributes["color"] = _see_through(swatch.stroke)
    return attributes


def join(text: str, theme: Theme) -> Attributes:
    """Return the look of the bar at which several states decide together."""
    return {
        "color": theme.muted,
        "fillcolor": theme.muted,
        "fixedsize": "true",
        "height": "0.045",
        "label": "",
        "shape": "box",
        "style": "filled",
        "tooltip": plain(text),
        "width": "0.5",
    }


def start(theme: Theme, *, fork: bool) -> Attributes:
    """Return the look of the arrow from a container's entry to its first state."""
    return {
        "arrowsize": "0.5",
        "color": theme.muted,
        "penwidth": "1",
        "style": "dashed" if fork else "solid",
        "weight": "3",
    }


def transition(
    outcomes: Sequence[str],
    node: Node,
    theme: Theme,
    marks: Marks,
    *,
    counts: Mapping[str, int],
    labelled: bool,
    implicit: bool,
    change: str | None = None,
    remark: str = "",
) -> Attributes:
    """Return the look of an arrow for one or several outcomes of a state.

    Args:
        outcomes: Their names.
        node: The state.
        theme: The colours.
        marks: The run to show.
        counts: How often each outcome was taken here.
        labelled: Whether to write the names.
        implicit: Whether nobody wrote the transition down.
        change: The change between two versions, "" for none; None if no versions are compared.
        remark: Numbers for the label.
    """
    if change is not None:
        return _compared_transition(outcomes, theme, change, remark, labelled=labelled)
    classes = {end_class(node.kind, outcome, node.success) for outcome in outcomes}
    found: OutcomeClass = classes.pop() if len(classes) == 1 else "other"
    swatch = theme.outcome(found)
    taken = sum(counts.get(outcome, 0) for outcome in outcomes)
    faint = marks.has_run and not taken
    stroke = theme.edge if found == "other" else swatch.stroke
    attributes = {
        "color": _see_through(stroke) if faint else stroke,
        "tooltip": plain(", ".join(outcomes)),
    }
    if implicit:
        attributes |= {"style": "dotted", "arrowsize": "0.5"}
    if taken:
        # Logarithmic for many runs: a loop may be taken a thousand times, its alternative once.
        wide = min(4.0, 1.2 + 0.6 * log2(1 + taken)) if marks.runs else 2.6
        attributes |= {"penwidth": f"{wide:.2g}"}
    if labelled or taken > 1 or remark:
        lines = [_outcome_line(o, node, theme, marks, counts, labelled=labelled) for o in outcomes]
        lines = [line for line in lines if line] or [""]
        if remark:
            lines[-1] += f'<font color="{theme.muted}">&#160;{markup(remark)}</font>'
        attributes["label"] = _beside(lines)
    return attributes


def _compared_transition(
    outcomes: Sequence[str], theme: Theme, change: str, remark: str, *, labelled: bool
) -> Attributes:
    """Return the look in a comparison: thick if added, dotted if removed, else faint."""
    swatch = _change_swatch(change, theme)
    look = {
        "added": {"penwidth": "2.8"},
        "removed": {"penwidth": "2", "style": "dotted"},
    }.get(change, {"penwidth": "1.2"})
    ink = swatch.text if change else theme.muted
    sign = f"<b>{SIGNS[change]}</b>&#160;" if change else ""
    names = [markup(outcome) if labelled else "" for outcome in outcomes]
    lines = [f"{sign}{name}" for name in names] if sign or labelled else []
    if remark:
        lines.append(markup(remark))
    attributes = {
        "color": swatch.stroke if change else theme.border,
        "tooltip": plain(", ".join(outcomes) + (f" ({change})" if change else "")),
        **look,
    }
    if lines:
        attributes["label"] = _beside([f'<font color="{ink}">{line}</font>' for line in lines])
    return attributes


def _change_swatch(change: str, theme: Theme) -> Swatch:
    return {
        "added": theme.success,
        "removed": theme.failure,
        "changed": theme.preempted,
    }.get(change, theme.inactive)


def _change_line(node: Node, theme: Theme) -> Attributes:
    """Return the border of a changed state: thick, dotted or dashed."""
    look = {
        "added": ("2.8", "rounded,filled"),
        "removed": ("2.2", "rounded,filled,dotted"),
        "changed": ("2.4", "rounded,filled,dashed"),
    }
    width, line = look[node.change]
    return {
        "color": _change_swatch(node.change, theme).stroke,
        "penwidth": width,
        "style": line,
    }


def _compared(node: Node, theme: Theme) -> Attributes:
    if not node.change:
        return _swatch(theme.inactive) | {"color": theme.border, "penwidth": "1"}
    return _swatch(_change_swatch(node.change, theme)) | _change_line(node, theme)


def _sign(node: Node, theme: Theme) -> str:
    if not node.change:
        return ""
    ink = _change_swatch(node.change, theme).text
    return f'<font color="{ink}"><b>{SIGNS[node.change]}</b>&#160;</font>'


def _legend(diagram: Diagram, theme: Theme) -> str:
    parts = []
    for change, words in diagram.legend:
        if change == "heat":
            parts.append(_heat_key(words, theme))
            continue
        ink = _change_swatch(change, theme).text if change else theme.muted
        sign = f"<b>{SIGNS[change]}</b>&#160;" if change else ""
        parts.append(f'<font point-size="9" color="{ink}">{sign}{markup(words)}</font>')
    return "&#160;&#160;&#160;".join(parts)


def _heat_key(words: str, theme: Theme) -> str:
    """Return a legend: a row of squares from cold to hot."""
    steps = [_mix(theme.inactive.fill, theme.heat, share) for share in (0.25, 0.5, 0.75, 1.0)]
    squares = "".join(f'<font point-size="11" color="{colour}">\u25a0</font>' for colour in steps)
    return f'{squares}<font point-size="9" color="{theme.muted}">&#160;{markup(words)}</font>'


def _note(node: Node, marks: Marks, theme: Theme, *, before: str) -> str:
    text = node.note or marks.notes.get(node.path, "")
    if not text:
        return ""
    # The stronger ink on warm fills: the muted one would be hard to read there.
    ink = theme.ink if marks.heat.get(node.path) else theme.muted
    return f'{before}<font point-size="8.5" color="{ink}">{markup(text)}</font>'


def _heated(node: Node, marks: Marks, theme: Theme) -> Attributes:
    """Return the fill of a state for its heat."""
    heat = marks.heat.get(node.path)
    if not heat:
        return {}
    return {"fillcolor": _mix(theme.inactive.fill, theme.heat, heat)}


def _mix(cold: str, hot: str, share: float) -> str:
    """Return a mix of two colours; `share` 0 is the first, 1 the second."""
    pairs = [(int(cold[i : i + 2], 16), int(hot[i : i + 2], 16)) for i in (1, 3, 5)]
    return "#" + "".join(f"{round(a + (b - a) * share):02X}" for a, b in pairs)


def note(text: str, theme: Theme) -> str:
    """Return an arrow's label with free text."""
    return _beside([f'<font color="{theme.muted}">{markup(text)}</font>'])


def _beside(lines: Sequence[str]) -> str:
    """Return a label with padding, so that it does not touch its arrow."""
    rows = "".join(f'<tr><td align="left">{line}</td></tr>' for line in lines)
    return f'<<table border="0" cellborder="0" cellspacing="0" cellpadding="2">{rows}</table>>'


def _outcome_line(
    outcome: str,
    node: Node,
    theme: Theme,
    marks: Marks,
    counts: Mapping[str, int],
    *,
    labelled: bool,
) -> str:
    """Return one line of an arrow's label: the outcome and its count."""
    count = counts.get(outcome, 0)
    found = end_class(node.kind, outcome, node.success)
    plain_ink = found == "other" or (marks.has_run and not count)
    ink = theme.muted if plain_ink else theme.outcome(found).text
    text = f"{markup(outcome) if labelled else ''}{_times(count)}"
    return f'<font color="{ink}">{text}</font>' if text else ""  # some Graphviz takes no empty one


def _identity(node: Node, diagram: Diagram) -> dict[str, str]:
    """Return id, tooltip and link: the path as id lets others find a state in the SVG."""
    lines = [node.path, f"{node.kind} ({node.type_name})" if node.type_name else node.kind]
    lines += [f"{name}: {value}" for name, value in node.details]
    if node.doc:
        lines.append(node.doc)
    identity = {"id": plain(node.path), "tooltip": plain("\n".join(lines))}
    if node.path in diagram.links:
        identity["URL"] = graphviz.escape(diagram.links[node.path])
        identity["target"] = "_self"
    return identity


def _state_label(node: Node, marks: Marks, theme: Theme) -> str:
    glyph = GLYPHS.get(node.kind, "")
    name = markup(node.caption or node.label)
    text = f'<font color="{theme.muted}" point-size="10">{glyph}&#160;</font>' if glyph else ""
    text = _sign(node, theme) + text
    text += f"<b>{name}</b>" if node.path in marks.active or node.hidden else name
    if node.kind == MISSING:
        return f"<{name} <i>missing</i>>"
    if node.hidden:
        word = KIND_WORDS.get(node.kind, "")
        note = f"{word}, {node.hidden} states" if word else f"{node.hidden} states"
        text += f'<br/><font point-size="8.5" color="{theme.muted}">{note}</font>'
        return f"<{text}{_note(node, marks, theme, before='<br/>')}>"
    if marks.notes or node.note:
        return f"<{text}{_note(node, marks, theme, before='<br/>')}>"
    text += _count(marks.visits.get(node.path, 0), theme.muted)
    last = marks.last.get(node.path)
    if (
        last is not None
        and node.path not in marks.active
        and ENDINGS[end_class(node.kind, last, node.success)]
    ):
        text += f"&#160;{ENDINGS[end_class(node.kind, last, node.success)]}"
    return f"<{text}>"


def _times(count: int) -> str:
    return f"&#160;\u00d7{count}" if count > 1 else ""


def _count(count: int, ink: str) -> str:
    return f'<font point-size="9" color="{ink}">&#160;{_times(count)}</font>' if count > 1 else ""


def _status(node: Node, marks: Marks, theme: Theme) -> tuple[Swatch, Attributes]:
    """Return colours, line and fill of a state for its marks."""
    last = marks.last.get(node.path)
    if node.kind == MISSING:
        return theme.failure, {"penwidth": "2.2", "style": "rounded,filled,dotted"}
    if node.path in marks.active:
        return theme.active, {"penwidth": "2.4"}
    if marks.runs and node.path in marks.visits:
        return theme.inactive, {"penwidth": "1.6"}
    if last is not None:
        return _ended(end_class(node.kind, last, node.success), theme)
    if marks.has_run:
        return theme.inactive, {"color": theme.faint, "fontcolor": theme.muted, "penwidth": "1"}
    return theme.inactive, {}


def _ended(kind: OutcomeClass, theme: Theme) -> tuple[Swatch, Attributes]:
    look = {
        "failure": {"penwidth": "2.2"},
        "preempted": {"penwidth": "2", "style": "rounded,filled,dashed"},
    }
    return theme.outcome(kind), look.get(kind, {"penwidth": "1.8"})


def _swatch(swatch: Swatch) -> Attributes:
    return {"fillcolor": swatch.fill, "color": swatch.stroke, "fontcolor": swatch.text}


def _see_through(colour: str) -> str:
    return colour + "59"
