"""Charts of many runs as SVG: histogram, ways taken, time by state. Lengths in CSS pixels."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING

from smachpy.events.outcome_classes import outcome_class
from smachpy_viz.model.labels import html_text, shorten
from smachpy_viz.pictures.theme import LIGHT

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from smachpy.events.introspection import StateRecord

WIDTH = 960
BINS = 24
STEPS = 10
"""Columns of states in the Sankey diagram; one more column stands for all later states."""
FLAME_ROW = 22
LETTER = 6.5
"""Approximate width of a character at the charts' font size."""


def histogram(values: Sequence[float], low: float, high: float) -> str:
    """Return a histogram from `low` to `high`; values outside count in the first or last bar."""
    counts = [0] * BINS
    for value in values:
        share = (value - low) / (high - low) if high > low else 0.0
        counts[min(BINS - 1, max(0, int(share * BINS)))] += 1
    most = max(counts, default=0) or 1
    bars = "".join(
        f'<rect x="{i * 8}" y="{24 - 22 * n / most:.1f}" width="7" height="{22 * n / most:.1f}"/>'
        for i, n in enumerate(counts)
        if n
    )
    return (
        f'<svg class="bars" width="{BINS * 8}" height="24" role="img" '
        f'aria-label="{len(values)} values">{bars}</svg>'
    )


def ways(runs: Iterable[tuple[Sequence[str], str]]) -> str:
    """Return a Sankey diagram of the sequences of states in runs.

    Args:
        runs: The names of the states in order, and the outcome, for each run.
    """
    links: Counter[tuple[int, str, str]] = Counter()
    number = 0
    for states, outcome in runs:
        number += 1
        shown = [*states[:STEPS], *(["\u2026"] if len(states) > STEPS else [])]
        # The empty first name gives each run a link into its first state: a column's heights are
        # then the sums of the links that arrive there.
        names = ["", *shown, f"\u25a0 {outcome}"]
        links.update((i, a, b) for i, (a, b) in enumerate(pairwise(names)))
    if not number:
        return ""
    columns: dict[int, Counter[str]] = {}
    for (step, _, name), n in links.items():
        columns.setdefault(step, Counter())[name] += n
    gap = 14
    gaps = gap * max(map(len, columns.values()))
    tall = max(320, gaps + 160)
    scale = (tall - gaps) / number
    apart = min(150.0, (WIDTH - 120) / max(1, len(columns)))
    # The bars: each column's states from the most frequent down, as tall as their share of runs.
    places: dict[tuple[int, str], tuple[float, float]] = {}
    parts: list[str] = []
    for step, column in sorted(columns.items()):
        y = 4.0
        for name, n in column.most_common():
            x = 8 + step * apart
            places[step, name] = (x, y)
            kind = outcome_class(name[2:]) if name.startswith("\u25a0 ") else "other"
            colour = LIGHT.outcome(kind).stroke
            parts.append(
                f'<rect x="{x:.1f}" y="{y:.1f}" width="8" height="{max(1.0, n * scale):.1f}" '
                f'fill="{colour}"><title>{html_text(name)}: {n}</title></rect>'
                f'<text x="{x + 11:.1f}" y="{y + 9:.1f}">{_label(name, apart - 14)} {n}</text>'
            )
            y += n * scale + gap
    # The ribbons: at each bar they are stacked in the sorted order of the links, so `leaving` and
    # `coming` count the runs whose ribbons are already placed there.
    leaving: Counter[tuple[int, str]] = Counter()
    coming: Counter[tuple[int, str]] = Counter()
    ribbons = []
    for (step, before, name), n in sorted(links.items()):
        if not step:  # from the empty name: not drawn
            continue
        (ax, ay), (bx, by) = places[step - 1, before], places[step, name]
        ay += leaving[step - 1, before] * scale
        by += coming[step, name] * scale
        leaving[step - 1, before] += n
        coming[step, name] += n
        high, middle = n * scale, (ax + 8 + bx) / 2
        ribbons.append(
            f'<path d="M{ax + 8:.1f},{ay:.1f}C{middle:.1f},{ay:.1f} {middle:.1f},{by:.1f} '
            f"{bx:.1f},{by:.1f}v{high:.1f}C{middle:.1f},{by + high:.1f} "
            f'{middle:.1f},{ay + high:.1f} {ax + 8:.1f},{ay + high:.1f}z"><title>'
            f"{html_text(before)} \u2192 {html_text(name)}: {n} of {number}</title></path>"
        )
    body = f'<g class="ribbons">{"".join(ribbons)}</g>{"".join(parts)}'
    return _svg(body, tall + 8, "ways taken")


def flame(record: StateRecord, seconds: Mapping[str, float]) -> str:
    """Return a flame graph of the time spent in each state, summed over all runs.

    Args:
        record: The machine.
        seconds: Time in each state, by path.
    """
    parts: list[str] = []
    deepest = 0

    def draw(state: StateRecord, x: float, wide: float, depth: int) -> None:
        nonlocal deepest
        deepest = max(deepest, depth)
        spent = seconds.get(state.path, 0.0)
        fill = LIGHT.container(depth + 1) if state.children else LIGHT.active.fill
        name = _label(state.label, wide - 8)
        parts.append(
            f'<g><rect x="{x:.1f}" y="{depth * FLAME_ROW}" width="{max(wide, 0.5):.1f}" '
            f'height="{FLAME_ROW - 2}" fill="{fill}" stroke="{LIGHT.border}"/>'
            f"<title>{html_text(state.path)}: {spent:.1f} s</title>"
            f'<text x="{x + 4:.1f}" y="{depth * FLAME_ROW + 14}">{name}</text></g>'
        )
        inside = sum(seconds.get(child.path, 0.0) for child in state.children)
        # The children of a concurrence run at once: their times can exceed that of the container.
        per_second = wide / max(inside, spent) if max(inside, spent) > 0 else 0.0
        for child in state.children:
            share = seconds.get(child.path, 0.0) * per_second
            if share > 0:
                draw(child, x, share, depth + 1)
            x += share

    if seconds.get(record.path, 0.0) > 0:
        draw(record, 1, WIDTH - 2, 0)
    return _svg("".join(parts), (deepest + 1) * FLAME_ROW, "time by state") if parts else ""


def _label(name: str, room: float) -> str:
    letters = int(room / LETTER)
    return html_text(shorten(name, letters)) if letters > 1 else ""


def _svg(body: str, height: float, words: str) -> str:
    return (
        f'<svg class="chart" viewBox="0 0 {WIDTH} {height:g}" role="img" '
        f'aria-label="{words}">{body}</svg>'
    )
