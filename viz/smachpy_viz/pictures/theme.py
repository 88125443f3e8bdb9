"""The colours of every picture, in one place: light and dark.

Colour is never the only sign: each status also has a line style or a glyph. Blue is the present;
green, vermilion and amber are ways of ending. Text has a contrast of at least 7:1 to its fill,
strokes at least 3:1 to the page, also for colour-blind readers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from smachpy.events.outcome_classes import OutcomeClass

FONT = "Liberation Sans,Arial,Helvetica,sans-serif"
"""Font family of all pictures; the first font is shipped, the others have the same metrics."""


@dataclass(frozen=True, slots=True)
class Swatch:
    """The three colours of one status, each `#RRGGBB`."""

    fill: str
    stroke: str
    text: str


@dataclass(frozen=True, slots=True)
class Theme:
    """One complete set of colours.

    Attributes:
        name: `light` or `dark`.
        containers: Fill by nesting depth; deeper levels alternate the last two.
        faint: Strokes of parts that a run did not visit.
        heat: Fill of the hottest state; other states get a mix with the usual fill.
    """

    name: str
    background: str
    ink: str
    muted: str
    faint: str
    edge: str
    border: str
    containers: tuple[str, ...]
    inactive: Swatch
    active: Swatch
    success: Swatch
    failure: Swatch
    preempted: Swatch
    other: Swatch
    waiting: Swatch
    heat: str

    def container(self, depth: int) -> str:
        """Return the fill of a container at `depth`; the outermost is 0."""
        last = len(self.containers) - 1
        return self.containers[depth if depth <= last else last - (depth - last) % 2]

    def outcome(self, kind: OutcomeClass) -> Swatch:
        """Return the colours of an outcome."""
        return {
            "success": self.success,
            "failure": self.failure,
            "preempted": self.preempted,
            "other": self.other,
        }[kind]


LIGHT = Theme(
    name="light",
    background="#FFFFFF",
    ink="#1F2933",
    muted="#55616E",
    faint="#B4BEC9",
    edge="#66727F",
    border="#9AA5B1",
    containers=("#F8FAFC", "#F2F5F8", "#EBF0F4", "#E4EAF0"),
    inactive=Swatch("#FFFFFF", "#7D8793", "#1F2933"),
    active=Swatch("#CFE8FA", "#0082D4", "#003E66"),
    success=Swatch("#DDF1EA", "#00664B", "#00493A"),
    failure=Swatch("#FBE3DA", "#9A2E08", "#7A2306"),
    preempted=Swatch("#FFF1CC", "#B07C00", "#6B4C00"),
    other=Swatch("#E8EDF3", "#52606D", "#323F4B"),
    waiting=Swatch("#F1E1EC", "#521A47", "#521A47"),
    heat="#F5B56A",
)

DARK = Theme(
    name="dark",
    background="#0F1720",
    ink="#E4E7EB",
    muted="#9AA5B1",
    faint="#4B5866",
    edge="#8794A3",
    border="#5F6C7B",
    containers=("#131C27", "#19242F", "#1F2B38", "#243241"),
    inactive=Swatch("#0F1720", "#79889A", "#E4E7EB"),
    active=Swatch("#0B3A5C", "#3FA3E8", "#D3EBFF"),
    success=Swatch("#0C3A2F", "#41D3A7", "#A8F0DA"),
    failure=Swatch("#4A2013", "#FF8661", "#FFD0C0"),
    preempted=Swatch("#3D2F06", "#C79A12", "#FFE29A"),
    other=Swatch("#27333F", "#9AA5B1", "#CBD2D9"),
    waiting=Swatch("#3B2335", "#E7A7DA", "#FADCF3"),
    heat="#7A4A0C",
)

THEMES = {theme.name: theme for theme in (LIGHT, DARK)}
