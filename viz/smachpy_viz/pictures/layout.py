"""Computes the positions in a picture: each container is laid out separately, innermost first.

A container becomes a page for `dot`, in which inner containers are boxes of known size with a port
for their entry on the upper border and one per outcome on the lower border. So an arrow crosses a
border only at an entry or an outcome, and the time grows with the number of states; laying out
everything at once takes minutes for 500 states. All containers of the same height share one run of
`dot`. Lengths are points (1/72 inch), y points up.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any, TypeAlias

from smachpy.exceptions import SmachError
from smachpy_viz.pictures.container_layout import (
    DOT_RADIUS,
    Page,
    Try,
    folds,
    loop_room,
    page_text,
    read_page,
    sprawl,
    tries,
    untidiness,
)
from smachpy_viz.pictures.curves import shift

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from smachpy_viz.pictures.shapes import Box
    from smachpy_viz.pictures.theme import Theme

    Engine = Callable[[Sequence[str]], Sequence[dict[str, Any] | None]]

Geometry: TypeAlias = dict[str, dict[str, str]]

CANVAS = "canvas"
"""Key of the whole picture's geometry."""
PAD = 14
"""Margin around a picture [points]."""
LONG = 1500
"""A container that needs a higher screen than this is folded, if possible [points]."""


class LayoutError(SmachError):
    """A container cannot be laid out, even with the simplest settings.

    Try: draw a part of the machine, and report the machine, as this should not happen.
    """


def compose(root: Box, theme: Theme, run: Engine) -> Geometry:
    """Return the positions of everything in `root`, as Graphviz attributes by name.

    Args:
        root: The picture.
        theme: Fonts and sizes.
        run: Lays out DOT texts and returns Graphviz' JSON for each; None if it crashed.

    Raises:
        LayoutError: `dot` crashes on a container.

    Blocks: while `run` blocks, once per nesting level.
    """
    return compose_all([root], theme, run)[0]


def compose_all(roots: Sequence[Box], theme: Theme, run: Engine) -> list[Geometry]:
    """Do `compose` for several pictures, with as many runs as the deepest one needs."""
    containers = [box for root in roots for box in root.containers()]
    pages: dict[int, Page] = {}
    # Innermost first: a page needs the sizes of the containers inside it.
    for height in range(1, max(root.height() for root in roots) + 1):
        level = [box for box in containers if box.height() == height]
        found = _results(level, tries, theme, pages, run)
        best = [
            min(each, key=untidiness) if each else _simplest(box, theme, pages, run)
            for box, each in zip(level, found, strict=True)
        ]
        long = [i for i, result in enumerate(best) if sprawl(result) > LONG]
        folded = _results([level[i] for i in long], folds, theme, pages, run)
        for i, each in zip(long, folded, strict=True):
            best[i] = min([best[i], *each], key=sprawl)
        for box, result in zip(level, best, strict=True):
            pages[id(box)] = read_page(box, result, pages)
    return [_geometry(root, pages) for root in roots]


def _results(
    boxes: Sequence[Box],
    ways: Callable[[Box], Sequence[Try]],
    theme: Theme,
    pages: Mapping[int, Page],
    run: Engine,
) -> list[list[dict[str, Any]]]:
    """Return the layouts of each container in each of its `ways`, without those that crashed."""
    tasks = [(box, how) for box in boxes for how in ways(box)]
    results = iter(run([page_text(box, how, theme, pages) for box, how in tasks]))
    return [
        [result for result in islice(results, len(ways(box))) if result is not None]
        for box in boxes
    ]


def _simplest(box: Box, theme: Theme, pages: Mapping[int, Page], run: Engine) -> dict[str, Any]:
    """Lay out a container whose other layouts made `dot` crash."""
    (result,) = run([page_text(box, Try(plain=True), theme, pages)])
    if result is None:
        raise LayoutError(
            f"picture: {box.attributes['id']}: `dot` crashes on it, whatever the settings. "
            "Try another version of Graphviz, or -o FILE.dot."
        )
    return result


def _geometry(root: Box, pages: Mapping[int, Page]) -> Geometry:
    page = pages.get(id(root))
    if page is None:  # a single leaf
        return {CANVAS: {}, root.name: {"pos": "0,0"}}
    width, height = page.width + 2 * PAD, page.height + 2 * PAD
    view = f"{width},{height},1,{page.width / 2},{page.height / 2}"
    geometry: Geometry = {CANVAS: {"viewport": view}}
    _place(root, pages, (0.0, 0.0), geometry)
    return geometry


def canvas_size(geometry: Geometry) -> tuple[float, float]:
    """Return width and height of a picture [points]; only roughly for a single leaf."""
    width, height, *_ = geometry[CANVAS].get("viewport", "300,60").split(",")
    return float(width), float(height)


def _place(
    box: Box, pages: Mapping[int, Page], origin: tuple[float, float], geometry: Geometry
) -> None:
    """Write absolute positions; `origin` is the lower left corner of the container."""
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
            right, below = loop_room(box, child)
            left = sx + x - (inner.width + right) / 2
            bottom = sy + y - (inner.height + below) / 2 + below
            _place(child, pages, (left, bottom), geometry)
