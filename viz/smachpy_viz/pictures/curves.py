"""Arrows in Graphviz' notation: chains of cubic Bezier curves, `e,x,y x,y x,y x,y x,y …`."""

from __future__ import annotations

import re
from itertools import combinations, pairwise
from math import dist, hypot, inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    Point = tuple[float, float]

ARROW = 6.2
"""Length of an arrow's head [points]."""
_PAIR = re.compile(r"(-?[\d.]+(?:e[+-]?\d+)?),(-?[\d.]+(?:e[+-]?\d+)?)")


def point(text: str) -> Point:
    """Read `x,y`."""
    x, y = text.split(",")
    return float(x), float(y)


def shift(text: str, dx: float, dy: float) -> str:
    """Return `text` with every `x,y` moved."""
    return _PAIR.sub(lambda m: f"{float(m[1]) + dx:.2f},{float(m[2]) + dy:.2f}", text)


def trace(curve: str, steps: int = 4) -> list[Point]:
    """Return points along the curve, `steps` per segment."""
    ends = [point(pair) for pair in curve.split() if pair[0] not in "es"]
    found = ends[:1]
    for i in range(0, len(ends) - 3, 3):
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = ends[i : i + 4]
        for step in range(1, steps + 1):
            at = step / steps
            a, b, c, d = (1 - at) ** 3, 3 * (1 - at) ** 2 * at, 3 * (1 - at) * at**2, at**3
            found.append((a * ax + b * bx + c * cx + d * dx, a * ay + b * by + c * cy + d * dy))
    return found


def length(line: Sequence[Point]) -> float:
    """Return the length of a polyline."""
    return sum(dist(a, b) for a, b in pairwise(line))


def crossings(lines: Iterable[Sequence[Point]]) -> int:
    """Return how often polylines cross each other."""
    # Bounding boxes first: most pairs of lines, and of their pieces, are far apart.
    boxed = [(line, _box(line)) for line in lines]
    return sum(
        _crossed(a, b, c, d)
        for (one, box_one), (two, box_two) in combinations(boxed, 2)
        if _overlap(box_one, box_two)
        for a, b in pairwise(one)
        if _overlap(_box((a, b)), box_two)
        for c, d in pairwise(two)
    )


def with_stem(curve: str, x: float, top: float) -> str:
    """Return the curve with a straight piece from (`x`, `top`) to its start."""
    head, _, rest = curve.rpartition("e,")
    arrow, _, points = rest.partition(" ")
    first_x, first_y = point(points.split(" ", 1)[0])
    stem = [(x + (first_x - x) * part, top + (first_y - top) * part) for part in (0, 1 / 3, 2 / 3)]
    text = " ".join(f"{px:.2f},{py:.2f}" for px, py in stem)
    return f"{head}e,{arrow} {text} {points}"


def straight(
    ends: tuple[Point, Point], halves: Sequence[tuple[float, float]], *, back: bool
) -> str:
    """Return a straight arrow between two boxes.

    Args:
        ends: The centres of the boxes, that with the arrow's tip last.
        halves: Half the width and height of each.
        back: Write it from its tip to its tail, as Graphviz has arrows that point back.
    """
    (x, y), (to_x, to_y) = ends
    dx, dy = to_x - x, to_y - y
    whole = hypot(dx, dy) or 1.0
    inside = [
        min(wide / abs(dx) if dx else inf, high / abs(dy) if dy else inf) for wide, high in halves
    ]
    begin, tip = min(inside[0], 0.5), max(1.0 - inside[1], 0.5)
    stop = max(begin, tip - ARROW / whole)
    places = [begin, begin + (stop - begin) / 3, stop - (stop - begin) / 3, stop]
    line = [f"{x + dx * at:.2f},{y + dy * at:.2f}" for at in places]
    if back:
        line.reverse()
    return f"{'s' if back else 'e'},{x + dx * tip:.2f},{y + dy * tip:.2f} {' '.join(line)}"


def around(start: Point, end: Point, lane: float, floor: float, corner: float) -> str:
    """Return a curve down from `start`, right to x = `lane`, up and left to `end`, with its arrow.

    Args:
        start: The start.
        end: The tip of the arrow.
        lane: Its right end.
        floor: Its lower end.
        corner: Radius of the corners.
    """
    (x, _), (tip_x, tip_y) = start, end
    turns = [
        (start, (x, floor), (x + corner, floor)),
        ((lane - corner, floor), (lane, floor), (lane, floor + corner)),
        ((lane, tip_y - corner), (lane, tip_y), (tip_x + ARROW, tip_y)),
    ]
    chain = [start]
    for before, bend, after in turns:
        if chain[-1] != before:
            chain += [chain[-1], before, before]
        chain += [bend, bend, after]
    points = " ".join(f"{px:.2f},{py:.2f}" for px, py in chain)
    return f"e,{tip_x:.2f},{tip_y:.2f} {points}"


def _box(line: Sequence[Point]) -> tuple[float, float, float, float]:
    xs = [x for x, _ in line]
    ys = [y for _, y in line]
    return min(xs), min(ys), max(xs), max(ys)


def _overlap(
    one: tuple[float, float, float, float], two: tuple[float, float, float, float]
) -> bool:
    return one[0] <= two[2] and two[0] <= one[2] and one[1] <= two[3] and two[1] <= one[3]


def _crossed(a: Point, b: Point, c: Point, d: Point) -> bool:
    return _turn(a, b, c) * _turn(a, b, d) < 0 and _turn(c, d, a) * _turn(c, d, b) < 0


def _turn(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
