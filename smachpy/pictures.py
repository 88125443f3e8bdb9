"""What shows machines and runs, offered by an installed package (`viz`).

Such a package has entry points in the group `smachpy.pictures`:

run: called as `draw(machine_or_record, file, run=events)`, writes a picture
svg: called as `draw(machine)`, returns SVG text
history: a class; its `on_event` takes events in, and `run=` above takes it
terminal: a class, shows a run in the terminal while it happens (`viz.TerminalView`)
viewer: a class, serves the live page in a process of its own (`viz.live.process.ViewerProcess`)
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any

from smachpy import log
from smachpy.events import Entered, Event, Left
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from smachpy.introspection import Described, StateRecord

GROUP = "smachpy.pictures"


def load(name: str) -> Any:
    """Return what an installed package offers as `name`, None when none does.

    Raises:
        ImportError: the package cannot be imported, or another package of its name can.
    """
    for point in entry_points(group=GROUP, name=name):
        try:
            return point.load()
        except AttributeError as error:  # a module of that name, but another one
            raise ImportError(f"{point.value} is missing", name=point.module) from error
    return None


def draw_run(record: StateRecord, events: Iterable[Event], file: Path) -> Path | None:
    """Draw `record`, with the run that `events` tell of, to `file`.

    Returns:
        The file, or None when nothing that draws is installed, or it failed (logged as a warning).

    Blocks: while the picture is laid out, under a second.
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
    """Return `machine` as SVG text, None when nothing that draws is installed.

    Raises:
        SmachError: drawing failed, for want of a `dot` program, say.

    Blocks: while the picture is laid out, under a second.
    """
    draw = load("svg")
    return None if draw is None else str(draw(machine))


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
