"""Charts of a report that concludes, as SVG: a square per run, a scatter, where runs ended."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from smachpy_viz.model.labels import html_text, shorten

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from smachpy_viz.runs.conclusion import Bound, RunEnd

WIDE: Final = 640
TALL: Final = 320
TOP: Final = 24
"""Room for the name of y above its highest number."""
LEFT: Final = 56
FOOT: Final = 40
SQUARE: Final = 14
PER_ROW: Final = 40
MOST_SQUARES: Final = 1_000
LEAST_SPAN: Final = 1e-9
TICKS: Final = 5


def squares(ends: Sequence[RunEnd]) -> str:
    """Return a square per run, those that failed with a cross, each a link to its row."""
    shown = ends[:MOST_SQUARES]
    parts = []
    for number, end in enumerate(shown):
        x, y = number % PER_ROW * (SQUARE + 2), number // PER_ROW * (SQUARE + 2)
        inside = (
            f'<circle cx="{x + SQUARE / 2}" cy="{y + SQUARE / 2}" r="{SQUARE / 2 - 1}"/>'
            if end.good
            else f'<text x="{x + SQUARE / 2}" y="{y + SQUARE / 2 + 1}">\u2715</text>'
        )
        parts.append(_link(number, end, inside))
    rows = -(-len(shown) // PER_ROW)
    return _svg(
        "".join(parts), min(len(shown), PER_ROW) * (SQUARE + 2), rows * (SQUARE + 2), "runs"
    )


def scatter(
    ends: Sequence[RunEnd],
    values: Sequence[Mapping[str, float]],
    keys: Sequence[str],
    shared: Sequence[Bound],
) -> str:
    """Return the runs as dots and crosses.

    Args:
        ends: How the runs ended.
        values: The varied numbers of each run.
        keys: The key of x, and of y; with one key, y is the run's number.
        shared: The bounds that the failures keep: the part within them is coloured.
    """
    xs = [one[keys[0]] for one in values]
    ys = (
        [one[keys[1]] for one in values]
        if len(keys) > 1
        else list(map(float, range(1, len(ends) + 1)))
    )
    by_key = {bound.key: bound for bound in shared}
    return _plot(ends, xs, ys, (keys[0], keys[1] if len(keys) > 1 else "run"), by_key)


def places(ends: Sequence[RunEnd]) -> str:
    """Return where the robots were last [m]; "" if no feedback says so."""
    there = [(end, number) for number, end in enumerate(ends) if end.place is not None]
    if not there:
        return ""
    known = [end.place for end, _ in there if end.place is not None]
    xs, ys = [x for x, _ in known], [y for _, y in known]
    numbers = [number for _, number in there]
    return _plot([end for end, _ in there], xs, ys, ("x [m]", "y [m]"), {}, numbers)


def _plot(
    ends: Sequence[RunEnd],
    xs: Sequence[float],
    ys: Sequence[float],
    names: tuple[str, str],
    shared: Mapping[str, Bound],
    numbers: Sequence[int] | None = None,
) -> str:
    (x_low, x_high), (y_low, y_high) = _range(xs), _range(ys)

    def at(x: float, y: float) -> tuple[float, float]:
        across = (x - x_low) / (x_high - x_low) * (WIDE - LEFT - 16)
        up = (y - y_low) / (y_high - y_low) * (TALL - FOOT - TOP)
        return LEFT + across, TALL - FOOT - up

    parts = []
    if shared:
        left, right = _within(shared.get(names[0]), x_low, x_high)
        bottom, top = _within(shared.get(names[1]), y_low, y_high)
        (x0, y1), (x1, y0) = at(left, bottom), at(right, top)
        parts.append(
            f'<rect class="bound" x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" '
            f'height="{y1 - y0:.1f}"/>'
        )
    for x, text in _ticks(xs, x_low, x_high):
        px, _ = at(x, y_low)
        parts.append(
            f'<line x1="{px:.1f}" x2="{px:.1f}" y1="{TOP}" y2="{TALL - FOOT}"/>'
            f'<text class="axis" x="{px:.1f}" y="{TALL - FOOT + 12}">{text}</text>'
        )
    for y, text in _ticks(ys, y_low, y_high):
        _, py = at(x_low, y)
        parts.append(
            f'<line x1="{LEFT}" x2="{WIDE - 16}" y1="{py:.1f}" y2="{py:.1f}"/>'
            f'<text class="axis" x="{LEFT - 24}" y="{py:.1f}">{text}</text>'
        )
    x_name, y_name = (html_text(shorten(name, 40)) for name in names)
    parts.append(f'<text class="axis" x="{(LEFT + WIDE) / 2}" y="{TALL - 8}">{x_name}</text>')
    parts.append(f'<text class="axis" x="{LEFT}" y="7">{y_name}</text>')
    order = sorted(range(len(ends)), key=lambda i: not ends[i].good)  # failures are drawn last
    for i in order:
        px, py = at(xs[i], ys[i])
        inside = (
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="4"/>'
            if ends[i].good
            else f'<text x="{px:.1f}" y="{py:.1f}">\u2715</text>'
        )
        parts.append(_link(i if numbers is None else numbers[i], ends[i], inside))
    return _svg("".join(parts), WIDE, TALL, f"{x_name} and {y_name}")


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    margin = max((high - low) * 0.05, abs(high) * 0.01, LEAST_SPAN)
    return low - margin, high + margin


def _ticks(values: Sequence[float], low: float, high: float) -> list[tuple[float, str]]:
    """Return round numbers of an axis with their texts; whole ones where all values are whole."""
    if not math.isfinite(high - low):
        return []
    step = 10.0 ** math.floor(math.log10((high - low) / TICKS))
    step *= next(factor for factor in (1, 2, 5, 10) if (high - low) / (step * factor) <= TICKS)
    if all(value % 1 == 0 for value in values):
        step = max(step, 1.0)
    numbers = range(math.ceil(low / step), math.floor(high / step) + 1)
    return [(number * step, f"{number * step:.10g}") for number in numbers]


def _within(bound: Bound | None, low: float, high: float) -> tuple[float, float]:
    if bound is None:
        return low, high
    return (bound.limit, high) if bound.above else (low, bound.limit)


def _link(number: int, end: RunEnd, inside: str) -> str:
    what = "succeeded" if end.good else f"{end.path}: {end.cause}"
    return f'<a href="#run-{number}"><title>run {number + 1}: {html_text(what)}</title>{inside}</a>'


def _svg(body: str, wide: float, tall: float, words: str) -> str:
    return (
        f'<svg class="chart dots" viewBox="0 0 {wide:g} {tall:g}" style="max-width:{wide:g}px" '
        f'role="img" aria-label="{words}">{body}</svg>'
    )
