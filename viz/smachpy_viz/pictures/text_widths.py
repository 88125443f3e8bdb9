"""Fixes the width of texts in an SVG, whatever font the reader has.

`dot` sized the boxes for the shipped font. With `textLength` (SVG 1.1, chapter 10.5) a viewer
without that font fits the letters of another font into the same width.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_TEXT = re.compile(rb'<text [^>]*?\bx="([^"]+)" y="([^"]+)"')


def with_widths(svg: bytes, drawn: Mapping[str, Any]) -> bytes:
    """Return `svg` with a fixed width for each text.

    Args:
        svg: The picture that `dot` drew.
        drawn: The same picture as Graphviz' JSON, which contains the widths.
    """
    # Matched by the point that a text is drawn from: SVG texts carry no other key. It is the text's
    # left end or, from some versions of Graphviz, its middle. y points down in SVG, up in the JSON.
    widths = dict(_widths(drawn))

    def fitted(match: re.Match[bytes]) -> bytes:
        width = widths.get((round(float(match[1]), 2), round(-float(match[2]), 2)))
        if not width:
            return match[0]
        return match[0] + f' textLength="{width:g}" lengthAdjust="spacingAndGlyphs"'.encode()

    return _TEXT.sub(fitted, svg)


def _widths(drawn: Mapping[str, Any]) -> Iterator[tuple[tuple[float, float], float]]:
    """Yield the point that each text is drawn from, and the text's width [points]."""
    for piece in (drawn, *drawn.get("objects", ()), *drawn.get("edges", ())):
        for name, steps in piece.items():
            if not name.endswith("draw_"):
                continue
            for step in steps:
                if step["op"] == "T":
                    x, y = step["pt"]
                    yield (round(x, 2), round(y, 2)), step["width"]
