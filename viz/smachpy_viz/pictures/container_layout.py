"""Writes one container as a DOT page, and reads the layout that `dot` returns.

Containers inside are boxes of known size, with a port for their entry on the upper border and one
per outcome on the lower border. Lengths are points (1/72 inch), y points up.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from itertools import groupby, pairwise, product
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import graphviz

from smachpy_viz.pictures import style
from smachpy_viz.pictures.curves import around, crossings, length, point, straight, trace, with_stem

if TYPE_CHECKING:
    from collections.abc import Mapping

    from smachpy_viz.pictures.shapes import Anchor, Arrow, Box
    from smachpy_viz.pictures.theme import Theme

    Point = tuple[float, float]

MARGIN = 12
DOT_RADIUS = 4
PORT = 8
INCH = 72.0
DETOUR = 250.0
"""One crossing counts as much as this much arrow length [points]."""
LOOP = 9
"""Distance between arrows that lead from a container back into it [points]."""
LOOP_LABEL = 26
"""Space for the label of such an arrow [points]."""
CORNER = 6
"""Radius of its corners [points]."""
LABEL = (16.0, 6.0)
"""Half the size of a usual arrow's label [points]."""
FOLDS = (2, 3, 4, 6, 8, 12, 16)
"""The numbers of pieces into which a container may be folded."""
MAX_UNFOLDED_STATES = 100
"""A container with more states is always folded: that is readable, and minutes faster."""
MAX_ARRANGED_STATES = 400
"""In a container with more states, they stand in rows, with straight arrows."""


# The attributes that a layout depends on. Without the others, writing and reading takes half the
# time.
_SIZES = frozenset(
    {"arrowsize", "fixedsize", "fontname", "fontsize", "height", "label", "margin", "peripheries"}
    | {"shape", "weight", "width"}
)


@dataclass(frozen=True, slots=True)
class Try:
    """One way to lay out a container; of several, the one with the shortest arrows is used.

    Attributes:
        side: Where back arrows enter an inner container, `e` or `w`.
        corner: Whether back arrows leave an outcome towards that side.
        back_first: Whether back arrows are placed before the others.
        plain: Straight arrows without sides, for containers that make `dot` crash otherwise.
        pieces: Number of columns for a chain, or of rows for states without arrows between them.
        in_rows: Whether all states stand in rows. `dot` gets no arrows then: with this many it
            would need minutes.
    """

    side: str = "e"
    corner: bool = False
    back_first: bool = False
    plain: bool = False
    pieces: int = 1
    in_rows: bool = False


@dataclass(frozen=True, slots=True)
class Page:
    """One container, laid out.

    Attributes:
        width, height: Outer size, including the entry dot and the pills on the border.
        dx, dy: Offset from the page's coordinates to those of the outer box.
        floor: Height of the lower border in the outer box.
        ports: Centre and width along x in the outer box, by part.
    """

    width: int
    height: int
    dx: float
    dy: float
    floor: float
    title: tuple[float, float]
    ports: dict[str, tuple[float, float]]
    spots: dict[str, tuple[float, float]]
    curves: dict[str, dict[str, str]]


def tries(box: Box) -> tuple[Try, ...]:
    """Return the ways to lay out a container; they differ only in how they treat back arrows."""
    if len(box.boxes) > MAX_ARRANGED_STATES:  # 1.2: a state is wider than high
        return (Try(pieces=ceil(1.2 * sqrt(len(box.boxes))), in_rows=True),)
    if len(box.boxes) > MAX_UNFOLDED_STATES:
        return folds(box)
    back = [arrow for arrow in box.arrows if arrow.back]
    if not back:
        return (Try(),)
    if not any(arrow.head.is_open or arrow.tail.is_open for arrow in back):
        return (Try(), Try(back_first=True))
    return tuple(Try(*choice) for choice in product("ew", (False, True), (False, True)))


def folds(box: Box) -> tuple[Try, ...]:
    """Return the ways to fold a container that is too long or too wide otherwise."""
    states = len(box.boxes)
    if states > MAX_ARRANGED_STATES:
        return ()
    if states > MAX_UNFOLDED_STATES:  # only one way: each takes seconds at this size
        return (Try(pieces=ceil(sqrt(states) / 2)),)
    return tuple(Try(pieces=pieces) for pieces in FOLDS if pieces <= min(states // 2, 16))


def pieces_of(box: Box, pieces: int) -> dict[str, int]:
    """Return the piece of each state of a folded container.

    The states of a chain are cut by their distance from the first; states without arrows between
    them are distributed in their order.
    """
    names = [child.name for child in box.boxes]
    following: dict[str, list[str]] = {name: [] for name in names}
    missing = dict.fromkeys(names, 0)
    for arrow in box.arrows:
        tail, head = arrow.tail.box, arrow.head.box
        if not arrow.back and tail != head and tail in missing and head in missing:
            following[tail].append(head)
            missing[head] += 1
    order = [name for name in names if not missing[name]]
    for name in order:  # grows while it is read: a state follows once all its predecessors are in
        for after in following[name]:
            missing[after] -= 1
            if not missing[after]:
                order.append(after)
    return {name: i * pieces // len(order) for i, name in enumerate(order)}


def page_text(box: Box, how: Try, theme: Theme, pages: Mapping[int, Page]) -> str:
    """Return a container as DOT text; `pages` holds the inner containers by `id`."""
    dot = graphviz.Digraph(graph_attr={**style.graph(theme), "label": box.attributes["label"]})
    dot.attr("graph", labelloc="t", pad="0", splines="line" if how.plain else "true")
    dot.attr("node", **_sizes(style.node_defaults(theme)))
    dot.attr("edge", **_sizes(style.edge_defaults(theme)))
    assert box.entry is not None
    dot.node(box.entry.name, label="", shape="point", width="0.03", height="0.03")
    for child in box.boxes:
        dot.node(child.name, **_block(child, pages.get(id(child)), loop_room(box, child)))
    for vertex in box.joins:
        dot.node(vertex.name, **_sizes(vertex.attributes))
    if box.pills:
        with dot.subgraph() as bottom:
            bottom.attr(rank="sink")
            for vertex in box.pills:
                bottom.node(vertex.name, **_sizes(vertex.attributes))
    loops = {arrow.name for child in box.boxes for arrow in _loops(box, child)}
    piece = pieces_of(box, how.pieces)
    for arrow in sorted(box.arrows, key=lambda arrow: how.back_first and not arrow.back):
        if arrow.name not in loops and (arrow.tail == arrow.head or not how.in_rows):
            apart = piece.get(arrow.tail.box, 0) != piece.get(arrow.head.box, 0)
            between = apart and arrow.tail.box in piece and arrow.head.box in piece
            _write_arrow(dot, box, arrow, how, free=between)
    if how.in_rows:
        dot.attr("graph", nodesep="0.8")  # room for the arrows' labels
        _write_rows(dot, [box.entry.name, *piece], {box.entry.name: -1, **piece})
    elif how.pieces > 1:
        _write_folds(dot, box, piece)
    return str(dot.source)


def _write_rows(dot: graphviz.Digraph, names: list[str], row: Mapping[str, int]) -> None:
    """Invisible arrows: each state stands below one of the row before."""
    rows = [list(each) for _, each in groupby(names, row.__getitem__)]
    for above, below in pairwise(rows):
        for i, name in enumerate(below):
            dot.edge(above[min(i, len(above) - 1)], name, style="invis")


def _write_folds(dot: graphviz.Digraph, box: Box, piece: Mapping[str, int]) -> None:
    """Write invisible arrows that put each column at the top, or each row below the last one."""
    assert box.entry is not None
    pieces: dict[int, list[str]] = {}
    for name, number in piece.items():
        pieces.setdefault(number, []).append(name)
    if any(arrow.tail.box in piece and arrow.head.box in piece for arrow in box.arrows):
        for names in pieces.values():
            dot.edge(box.entry.name, names[0], style="invis")
        return
    for above, below in pairwise(pieces.values()):
        for one, two in zip(above, below, strict=False):
            dot.edge(one, two, style="invis")


def _block(child: Box, page: Page | None, room: tuple[int, int]) -> Mapping[str, str]:
    """Return the node for a child: itself, or a table with the size of its page and loops."""
    if page is None:
        return _sizes(child.attributes)
    right, below = room
    width = page.width + right
    rows = [
        _strip(width, {part: span for part, span in page.ports.items() if part == "in"}),
        f'<td fixedsize="true" width="{width}" height="{page.height - 4}"></td>',
        _strip(width, {part: span for part, span in page.ports.items() if part != "in"}),
    ]
    if below:
        rows.append(f'<td fixedsize="true" width="{width}" height="{below}"></td>')
    table = '<table border="0" cellborder="0" cellspacing="0" cellpadding="0">'
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    return {"label": f"<{table}{body}</table>>", "margin": "0", "shape": "plain"}


def _sizes(attributes: Mapping[str, str]) -> dict[str, str]:
    return {name: value for name, value in attributes.items() if name in _SIZES}


def _loops(box: Box, child: Box) -> list[Arrow]:
    """Return the arrows from an outcome of an open child straight back into it."""
    if child.entry is None:
        return []
    return [
        arrow
        for arrow in box.arrows
        if arrow.tail.box == arrow.head.box == child.name and arrow.tail.part
    ]


def loop_room(box: Box, child: Box) -> tuple[int, int]:
    """Return the space for such arrows to the right of a child and below it [points]."""
    loops = _loops(box, child)
    if not loops:
        return 0, 0
    label = LOOP_LABEL if any("label" in arrow.attributes for arrow in loops) else 0
    return LOOP * (len(loops) + 2) + label, LOOP * len(loops)


def _draw_loops(box: Box, pages: Mapping[int, Page], page: Page) -> None:
    """Draw the loops of open children here: `dot` would route them across their neighbours."""
    for child in box.boxes:
        inner = pages.get(id(child))
        for i, arrow in enumerate(_loops(box, child)):
            assert inner is not None
            right, below = loop_room(box, child)
            x, y = page.spots[child.name]
            left, bottom = x - (inner.width + right) / 2, y - (inner.height + below) / 2 + below
            start = (left + inner.ports[arrow.tail.part][0], bottom)
            wall = left + inner.width
            lane = wall + LOOP * (i + 2) - CORNER / 2
            middle = bottom + inner.floor + 0.6 * (inner.height - inner.floor) - 2 * LOOP * i
            page.curves[arrow.name] = {
                "pos": around(start, (wall, middle), lane, bottom - LOOP * (i + 1) + 1, CORNER),
                "lp": f"{lane + LOOP_LABEL / 2 + 1},{middle - 2 * LOOP}",
            }


def _strip(width: int, ports: Mapping[str, tuple[float, float]]) -> str:
    """Return a table row, two points high, with a named cell for each port."""
    cells = []
    at = 0
    for part, (centre, span) in sorted(ports.items(), key=lambda item: item[1][0]):
        left = max(at, round(centre - span / 2))
        if left > at:
            cells.append(_cell(left - at))
        at = min(width, max(left + 1, round(centre + span / 2)))
        cells.append(_cell(at - left, f' port="{part}"'))
    if at < width:
        cells.append(_cell(width - at))
    return (
        '<td><table border="0" cellborder="0" cellspacing="0" cellpadding="0"><tr>'
        f"{''.join(cells)}</tr></table></td>"
    )


def _cell(width: int, port: str = "") -> str:
    return f'<td fixedsize="true" width="{width}" height="2"{port}></td>'


def _write_arrow(dot: graphviz.Digraph, box: Box, arrow: Arrow, how: Try, *, free: bool) -> None:
    """Write an arrow; a `free` one does not constrain the vertical order of its ends."""
    towards = how.side if arrow.back and how.corner else ""
    tail, head = _end(arrow.tail, box, f"s{towards}"), _end(arrow.head, box, how.side)
    if how.plain:
        tail, head = tail.partition(":")[0], head.partition(":")[0]
    attributes = {**_sizes(arrow.attributes), "id": arrow.name}
    if free:
        attributes["constraint"] = "false"
    # Written reversed and drawn with `dir=back`: `dot` puts tails above heads, so a back arrow
    # written as it is would turn the reading direction around.
    if arrow.back:
        dot.edge(head, tail, dir="back", **attributes)
    else:
        dot.edge(tail, head, **attributes)


def _end(anchor: Anchor, box: Box, side: str) -> str:
    if anchor.box == box.name:
        return f"{anchor.box}_{anchor.part}"
    if anchor.is_open and anchor.part:
        return f"{anchor.box}:{anchor.part}:{'n' if anchor.part == 'in' else side}"
    return f"{anchor.box}:{side}" if anchor.is_open else anchor.box


def read_page(box: Box, result: Mapping[str, Any], pages: Mapping[int, Page]) -> Page:
    """Return the page of `box` from the layout of `dot`.

    Args:
        box: The container.
        result: Graphviz' JSON.
        pages: The pages of the inner containers, by `id`.
    """
    found = {item["name"]: item for item in result.get("objects", ()) if "pos" in item}
    curves = {
        edge["id"]: {key: edge[key] for key in ("pos", "lp") if key in edge}
        for edge in _arrows(result)
    }
    loops = [arrow for child in box.boxes for arrow in _loops(box, child)]
    arrows = Counter(anchor for arrow in box.arrows for anchor in (arrow.tail, arrow.head))
    for arrow in box.arrows:
        if arrow.name not in curves and arrow not in loops:
            label_at_tail = arrows[arrow.tail] < arrows[arrow.head]
            curves[arrow.name] = _straight(box, arrow, found, label_at_tail=label_at_tail)
    left, right, top = _extent(result, curves)
    spots = {name: point(item["pos"]) for name, item in found.items()}
    assert box.entry is not None
    entry_x, _ = spots[box.entry.name]
    first = next((arrow.name for arrow in box.arrows if arrow.tail.part == "in"), None)
    if first is not None:
        curves[first]["pos"] = with_stem(curves[first]["pos"], entry_x, top)
    spots[box.entry.name] = (entry_x, top)
    title_x, right = _title(result, entry_x, left, right)
    dx, dy, floor = MARGIN - left, float(MARGIN), 0.0
    ports = {"in": (entry_x + dx, float(PORT))}
    if box.pills:
        dy = -min(spots[p.name][1] - _size(found[p.name], "height") / 2 for p in box.pills)
        floor = spots[box.pills[0].name][1] + dy
        for i, vertex in enumerate(box.pills):
            ports[f"o{i}"] = (spots[vertex.name][0] + dx, _size(found[vertex.name], "width"))
    page = Page(
        width=ceil(right + dx + MARGIN),
        height=ceil(top + dy + DOT_RADIUS),
        dx=dx,
        dy=dy,
        floor=floor,
        title=(title_x, point(result["lp"])[1]),
        ports=ports,
        spots=spots,
        curves=curves,
    )
    _draw_loops(box, pages, page)
    return page


def _straight(
    box: Box, arrow: Arrow, found: Mapping[str, Mapping[str, Any]], *, label_at_tail: bool
) -> dict[str, str]:
    """Return an arrow that `dot` has not seen, from border to border."""
    tail, head = (
        found[_end(anchor, box, "s").partition(":")[0]] for anchor in (arrow.tail, arrow.head)
    )
    ends = point(tail["pos"]), point(head["pos"])
    sizes = [(_size(item, "width") / 2, _size(item, "height") / 2) for item in (tail, head)]
    curve = {"pos": straight(ends, sizes, back=arrow.back)}
    if "label" in arrow.attributes:  # where fewer arrows meet
        (x, y), (_, high) = (ends[0], sizes[0]) if label_at_tail else (ends[1], sizes[1])
        curve["lp"] = f"{x:.2f},{y + high + LABEL[1]:.2f}"
    return curve


def _extent(
    result: Mapping[str, Any], curves: Mapping[str, Mapping[str, str]]
) -> tuple[float, float, float]:
    """Return left, right and top of a page; Graphviz' bounding box does not include all loops."""
    left, _, right, top = map(float, result["bb"].split(","))
    for attributes in curves.values():
        for x, _ in trace(attributes["pos"]):
            left, right = min(left, x), max(right, x)
    return left, right, top


def untidiness(result: Mapping[str, Any]) -> float:
    """Return the cost of a layout: the length of all arrows [points] and a penalty per fault.

    A fault is an arrow that crosses another arrow, a label or a state that it does not belong to.
    """
    arrows = _arrows(result)
    traces = [trace(edge["pos"]) for edge in arrows]
    faults = crossings([line[::2] for line in traces])
    states = [
        (item["_gvid"], *point(item["pos"]), _size(item, "width") / 2, _size(item, "height") / 2)
        for item in result.get("objects", ())
        if "pos" in item
    ]
    labels = [(edge["id"], *point(edge["lp"])) for edge in arrows if "lp" in edge]
    for edge, line in zip(arrows, traces, strict=True):
        ends = {edge["tail"], edge["head"]}
        faults += sum(
            any(abs(x - at_x) < wide - 1 and abs(y - at_y) < high - 1 for x, y in line)
            for number, at_x, at_y, wide, high in states
            if number not in ends
        )
        faults += sum(
            any(abs(x - at_x) < LABEL[0] and abs(y - at_y) < LABEL[1] for x, y in line)
            for name, at_x, at_y in labels
            if name != edge["id"]
        )
    return sum(map(length, traces)) + DETOUR * faults


def sprawl(result: Mapping[str, Any]) -> float:
    """Return the height of a 16:10 screen that shows the whole page at full size [points]."""
    _, _, width, height = map(float, result["bb"].split(","))
    return max(height, width / 1.6)


def _arrows(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the visible arrows of a page: those that fold it have no id."""
    return [edge for edge in result.get("edges", ()) if "id" in edge]


def _title(
    result: Mapping[str, Any], entry_x: float, left: float, right: float
) -> tuple[float, float]:
    """Return the title's centre and the page's right end.

    The title is to the left of the line from the entry if it fits there, else to its right.
    """
    width = float(result["lwidth"]) * INCH
    if left + width + DOT_RADIUS <= entry_x:
        return left + width / 2 - 2, right
    beside = entry_x + DOT_RADIUS + 2
    return beside + width / 2, max(right, beside + width - DOT_RADIUS)


def _size(item: Mapping[str, Any], side: str) -> float:
    return float(item[side]) * INCH
