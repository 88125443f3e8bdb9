"""Pictures and views of machines and runs, provided by an installed package (`smachpy_viz`).

Entry points, because imports go from `smachpy_viz` to `smachpy` only. The group
`smachpy.pictures` has:

run: called as `draw(machine_or_record, file, run=events)`, writes a picture
svg: called as `draw(machine)`, returns SVG text
history: a class that collects events by `on_event`, for the argument `run` above
terminal: a class, shows a run in the terminal while it happens (`smachpy.viz.TerminalView`)
viewer: a class, serves the live page in a process of its own
    (`smachpy_viz.live.process.ViewerProcess`)
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from smachpy.base import log
from smachpy.events import Entered, Event, Left
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from smachpy.events.introspection import Described, StateRecord

GROUP = "smachpy.pictures"


def load(name: str) -> Any:
    """Return the entry point `name`; None if no installed package has it.

    Raises:
        ImportError: the package cannot be imported, or another module has its name.
    """
    for point in entry_points(group=GROUP, name=name):
        try:
            return point.load()
        except AttributeError as error:  # a module of that name, but another one
            raise ImportError(f"{point.value} is missing", name=point.module) from error
    return None


def draw_run(record: StateRecord, events: Iterable[Event], file: Path) -> Path | None:
    """Draw `record`, with the run of these `events`, to `file`.

    Returns:
        The file; None if no package that draws is installed, or if it failed (logged as a warning).

    Blocks: for the layout, less than a second.
    """
    try:
        draw = load("run")
        if draw is None:
            return None
        file.parent.mkdir(parents=True, exist_ok=True)
        draw(record, file, run=list(events))
    except (SmachError, OSError, ImportError) as error:
        log.logwarn(f"{record.path}: no picture {str(file)!r}: {error}")
        return None
    return file


def draw_svg(machine: Described) -> str | None:
    """Return `machine` as SVG text; None if no package that draws is installed.

    Raises:
        SmachError: drawing failed, for instance because there is no program `dot`.

    Blocks: for the layout, less than a second.
    """
    draw = load("svg")
    return None if draw is None else str(draw(machine))


def draw_moments(
    record: StateRecord, moments: Iterable[tuple[str, str | None]], file: Path
) -> Path | None:
    """Draw a run given as pairs (path, outcome), with the outcome None where a state begins.

    Returns, Blocks: as `draw_run`.
    """
    events = [
        Entered(path, 0.0, 0) if outcome is None else Left(path, 0.0, 0, outcome)
        for path, outcome in moments
    ]
    return draw_run(record, events, file)
