"""Pictures for messages: drawn by an installed package, or not at all.

A package that draws offers functions in the entry-point group `smachpy.pictures`: `run`, called as
`draw(record, file, run=events)`, and `svg`, called as `draw(machine)`, which returns SVG text.
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING

from smachpy import log
from smachpy.events import Entered, Event, Left
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from smachpy.introspection import StateRecord
    from smachpy.state import State

GROUP = "smachpy.pictures"


def draw_run(record: StateRecord, events: Iterable[Event], file: Path) -> Path | None:
    """Draw `record`, with the run that `events` tell of, to `file`.

    Returns:
        The file, or None when nothing that draws is installed, or it failed (logged as a warning).

    Blocks: while the picture is laid out, under a second.
    """
    for point in entry_points(group=GROUP, name="run"):
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            point.load()(record, file, run=list(events))
        except (SmachError, OSError, ImportError) as error:
            log.logwarn(f"{record.path}: no picture {str(file)!r}: {error}")
            return None
        return file
    return None


def draw_svg(machine: State) -> str | None:
    """Return `machine` as SVG text, None when nothing that draws is installed.

    Raises:
        SmachError: drawing failed, for want of a `dot` program, say.

    Blocks: while the picture is laid out, under a second.
    """
    for point in entry_points(group=GROUP, name="svg"):
        picture: str = point.load()(machine)
        return picture
    return None


def draw_moments(
    record: StateRecord, moments: Iterable[tuple[str, str | None]], file: Path
) -> Path | None:
    """Draw a run given as pairs (path, outcome), the outcome None where the state begins.

    Returns, Blocks: as `draw_run`.
    """
    events = [
        Entered(path, 0.0, 0) if outcome is None else Left(path, 0.0, 0, outcome)
        for path, outcome in moments
    ]
    return draw_run(record, events, file)
