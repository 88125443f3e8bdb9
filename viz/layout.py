"""Where every piece of a picture goes: each container is laid out on its own, innermost first.

A container becomes a page for `dot`, in which the containers inside are boxes of known size with
a port for their entry on the upper border and one per outcome on the lower one. So no arrow ever
crosses a border except at an entry or an outcome, and the time grows with the number of states,
while one layout of everything takes minutes for 500 states. All containers of one height share
one run of `dot`. Lengths are points (1/72 inch), y points up.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, product
from math import ceil
from typing import TYPE_CHECKING, Any, TypeAlias

import graphviz

from viz import style
from viz.curves import crossings, length, point, shift, trace, with_stem

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from viz.graph import Anchor, Arrow, Box
    from viz.theme import Theme

    Engine = Callable[[Sequence[str]], list[dict[str, Any]]]

Geometry: TypeAlias = dict[str, dict[str, str]]

CANVAS = "canvas"
"""Name of the geometry of the whole picture."""
PAD = 14
MARGIN = 12
DOT_RADIUS = 4
PORT = 8
INCH = 72.0
DETOUR = 250.0
"""How much longer arrows may be to avoid one crossing [points]."""


@dataclass(frozen=True, slots=True)
class _Try:
    """A way to lay a container out; of several the one with the shortest arrows is kept.

    Attributes:
        side: Where arrows come back into a container inside, `e` or `w`.
        corner: Whether arrows that lead back leave an outcome towards that side.
        back_first: Whether arrows that lead back are placed before the others.
    """

    side: str = "e"
    corner: bool = False
    back_first: bool = False


@dataclass(frozen=True, slots=True)
class _Page:
    """One container, laid out.

    Attributes:
        width, height: Outer size with the dot and the pills that stand over the border.
        dx, dy: From coordinates of the page to coordinates of the outer box.
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


def compose(root: Box, theme: Theme, run: Engine) -> Geometry:
    """Return the positions of everything in `root`, as Graphviz attributes by name.

    Args:
        root: The picture.
        theme: Fonts and sizes.
        run: Lays DOT texts out and returns Graphviz' JSON for each.

    Blocks: while `run` does, once per nesting level.
    """
    return compose_all([root], theme, run)[0]


def compose_all(roots: Sequence[Box], theme: Theme, run: Engine) -> list[Geometry]:
    """`compose` for several pictures with as few runs as for the deepest one."""
    containers = [box for root in roots for box in root.containers()]
    pages: dict[int, _Page] = {}
    for height in range(1, max(root.height() for root in roots) + 1):
        level = [box for box in containers if box.height() == height]
        texts = [_page_text(box, how, theme, pages) for box in level for how in _tries(box)]
        results = iter(run(texts))
        for box in level:
            found = list(islice(results, len(_tries(box))))
            best = found[0] if len(found) == 1 else min(found, key=_untidiness)
            pages[id(box)] = _page(box, best)
    return [_geometry(root, pages) for root in roots]


def _geometry(root: Box, pages: Mapping[int, _Page]) -> Geometry:
    page = pages.get(id(root))
    if page is None:  # a plain state, alone
        return {CANVAS: {}, root.name: {"pos": "0,0"}}
    width, height = page.width + 2 * PAD, page.height + 2 * PAD
    view = f"{width},{height},1,{page.width / 2},{page.height / 2}"
    geometry: Geometry = {CANVAS: {"viewport": view}}
    _place(root, pages, (0.0, 0.0), geometry)
    return geometry


def canvas_size(geometry: Geometry) -> tuple[float, float]:
    """Return width and height of a laid out picture in points, roughly for a plain state."""
    width, height, *_ = geometry[CANVAS].get("viewport", "300,60").split(",")
    return float(width), float(height)


def _tries(box: Box) -> tuple[_Try, ...]:
    """Ways to lay a container out; they differ only for arrows that lead back."""
    back = [arrow for arrow in box.arrows if arrow.back]
    if not back:
        return (_Try(),)
    if not any(arrow.head.is_open or arrow.tail.is_open for arrow in back):
        return (_Try(), _Try(back_first=True))
    return tuple(_Try(*choice) for choice in product("ew", (False, True), (False, True)))


def _page_text(box: Box, how: _Try, theme: Theme, pages: Mapping[int, _Page]) -> str:
    dot = graphviz.Digraph(graph_attr={**style.graph(theme), "label": box.attributes["label"]})
    dot.attr("graph", labelloc="t", pad="0")
    dot.attr("node", **style.node_defaults(theme))
    dot.attr("edge", **style.edge_defaults(theme))
    assert box.entry is not None
    dot.node(box.entry.name, label="", shape="point", width="0.03", height="0.03")
    for child in box.boxes:
        dot.node(child.name, **_block(child, pages.get(id(child))))
    for vertex in box.joins:
        dot.node(vertex.name, **vertex.attributes)
    if box.pills:
        with dot.subgraph() as bottom:
            bottom.attr(rank="sink")
            for vertex in box.pills:
                bottom.node(vertex.name, **vertex.attributes)
    for arrow in sorted(box.arrows, key=lambda arrow: how.back_first and not arrow.back):
        _write_arrow(dot, box, arrow, how)
    return str(dot.source)


def _block(child: Box, page: _Page | None) -> Mapping[str, str]:
    """The node that stands for a child: itself, or a table of the size of its page."""
    if page is None:
        return child.attributes
    inner = page.height - 4
    rows = (
        _strip(page.width, {part: span for part, span in page.ports.items() if part == "in"}),
        f'<td fixedsize="true" width="{page.width}" height="{inner}"></td>',
        _strip(page.width, {part: span for part, span in page.ports.items() if part != "in"}),
    )
    table = '<table border="0" cellborder="0" cellspacing="0" cellpadding="0">'
    body = "".join(f"<tr>{row}</tr>" for row in rows)
    return {"label": f"<{table}{body}</table>>", "margin": "0", "shape": "plain", "style": ""}


def _strip(width: int, ports: Mapping[str, tuple[float, float]]) -> str:
    """A row two points high with a named cell per port."""
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


def _write_arrow(dot: graphviz.Digraph, box: Box, arrow: Arrow, how: _Try) -> None:
    towards = how.side if arrow.back and how.corner else ""
    tail, head = _end(arrow.tail, box, f"s{towards}"), _end(arrow.head, box, how.side)
    attributes = {**arrow.attributes, "id": arrow.name}
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


def _page(box: Box, result: Mapping[str, Any]) -> _Page:
    found = {item["name"]: item for item in result.get("objects", ()) if "pos" in item}
    curves = {
        edge["id"]: {key: edge[key] for key in ("pos", "lp") if key in edge}
        for edge in result.get("edges", ())
    }
    left, right, top = _extent(result, curves)
    spots = {name: point(item["pos"]) for name, item in found.items()}
    assert box.entry is not None
    entry_x, _ = spots[box.entry.name]
    first = next((arrow.name for arrow in box.arrows if arrow.tail.part == "in"), None)
    if first is not None:
        curves[first]["pos"] = with_stem(curves[first]["pos"], entry_x, top)
    spots[box.entry.name] = (entry_x, top)
    title_x, right = _title(result, entry_x, right)
    dx, dy, floor = MARGIN - left, float(MARGIN), 0.0
    ports = {"in": (entry_x + dx, float(PORT))}
    if box.pills:
        dy = -min(spots[p.name][1] - _size(found[p.name], "height") / 2 for p in box.pills)
        floor = spots[box.pills[0].name][1] + dy
        for i, vertex in enumerate(box.pills):
            ports[f"o{i}"] = (spots[vertex.name][0] + dx, _size(found[vertex.name], "width"))
    return _Page(
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


def _extent(
    result: Mapping[str, Any], curves: Mapping[str, Mapping[str, str]]
) -> tuple[float, float, float]:
    """Left, right and upper end of a page; loops may leave the box that Graphviz reports."""
    left, _, right, top = map(float, result["bb"].split(","))
    for attributes in curves.values():
        for x, _ in trace(attributes["pos"]):
            left, right = min(left, x), max(right, x)
    return left, right, top


def _untidiness(result: Mapping[str, Any]) -> float:
    """Length of all arrows [points]; a crossing counts as much as a long way round."""
    traces = [trace(edge["pos"]) for edge in result.get("edges", ())]
    return sum(map(length, traces)) + DETOUR * crossings([line[::2] for line in traces])


def _title(result: Mapping[str, Any], entry_x: float, right: float) -> tuple[float, float]:
    """Centre of the title, left of the line from the entry if it fits, else beside it."""
    width = float(result["lwidth"]) * INCH
    if width + DOT_RADIUS <= entry_x:
        return width / 2 - 2, right
    left = entry_x + DOT_RADIUS + 2
    return left + width / 2, max(right, left + width - DOT_RADIUS)


def _place(
    box: Box, pages: Mapping[int, _Page], origin: tuple[float, float], geometry: Geometry
) -> None:
    """Write absolute positions; `origin` is the lower left corner of the outer box."""
    page = pages[id(box)]
    ox, oy = origin
    sx, sy = ox + page.dx, oy + page.dy
    geometry[box.name] = {
        "bb": f"{ox:.2f},{oy + page.floor:.2f},{ox + page.width:.2f},"
        f"{oy + page.height - DOT_RADIUS:.2f}",
        "lp": f"{sx + page.title[0]:.2f},{sy + page.title[1]:.2f}",
    }
    for name, (x, y) in page.spots.items():
        geometry.setdefault(name, {})["pos"] = f"{sx + x:.2f},{sy + y:.2f}"
    for name, attributes in page.curves.items():
        geometry[name] = {key: shift(value, sx, sy) for key, value in attributes.items()}
    for child in box.boxes:
        inner = pages.get(id(child))
        if inner is not None:
            x, y = page.spots[child.name]
            corner = (sx + x - inner.width / 2, sy + y - inner.height / 2)
            _place(child, pages, corner, geometry)


def _size(item: Mapping[str, Any], side: str) -> float:
    return float(item[side]) * INCH
