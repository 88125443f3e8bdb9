"""A recorded run as one HTML file that opens without a server."""

from __future__ import annotations

import json
from collections import deque
from typing import TYPE_CHECKING, Any, Final

from smachpy.events.recording import Streamed
from smachpy.events.run_state import RunState
from smachpy_viz.live import assets
from smachpy_viz.live.machines import Machine
from smachpy_viz.model.why import why
from smachpy_viz.runs.floor import read_floor
from smachpy_viz.runs.notes import read_notes
from smachpy_viz.runs.statistics import StatisticsOfFiles

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path

    from smachpy.events.introspection import StateRecord
    from smachpy.events.recording import Recording
    from smachpy_viz.runs.notes import RunNote

MOST_EVENTS: Final = 100_000
"""The most events in a page; of those before them it has the counts and newest values."""


def standalone_page(
    recording: Recording, runs: Iterable[str | Path] = (), floor: Path | None = None
) -> str:
    """Return the page.

    Args:
        recording: The run.
        runs: Recorded runs for the statistics in the diagram.
        floor: A map_server YAML file, used if the recording has no map.

    Raises:
        RecordingError: a file of `runs`, or that with the recording's notes, cannot be read.
        InputFileError: `floor` is not a valid map.
    """
    map_of_file = None if floor is None else read_floor(floor)
    machine = Machine(recording.path.name, lambda _machine: None, floor=map_of_file)
    machine.load(recording)
    statistics = StatisticsOfFiles(runs).of(recording.record)
    notes = read_notes(recording.path)
    # The cause of the end may be among those that are not in the page.
    events = Streamed(recording.path) if recording.folded else recording.events
    return page_of(machine, recording.record, statistics, notes=notes, events=events)


def page_of(
    machine: Machine,
    record: StateRecord,
    statistics: dict[str, Any] | None = None,
    view: str = "",
    notes: Sequence[RunNote] = (),
    events: Iterable[dict[str, Any]] | None = None,
) -> str:
    """Return the page of a machine as it is now, with its newest events.

    Args:
        machine: The machine.
        record: Its structure.
        statistics: Those of recorded runs.
        view: What the page shows at first: the fragment of an address, with instant and notes.
        notes: The notes that all pages share.
        events: The events that explain its end; None: those that it has kept.
    """
    base, kept = machine.history()
    before, newest = RunState(base), deque[dict[str, Any]]()
    for event in kept:
        newest.append(event)
        if len(newest) > MOST_EVENTS:
            before.fold(newest.popleft())
    facts = json.loads(machine.snapshot(short=True)[1])
    run = {
        "model": assets.model(record),
        "snap": {**facts, "base": before.data, "events": list(newest)},
        "observed": machine.observed(),
        "statistics": statistics,
        "view": view,
        "notes": list(notes),
        "why": why(record, machine.events() if events is None else events).to_json(),
    }
    return assets.standalone(run, record.label)
