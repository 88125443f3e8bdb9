"""A recorded run as one HTML file that opens without a server."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from viz.live import assets as page
from viz.live.machines import Machine
from viz.model.why import why
from viz.runs.floor import read_floor
from viz.runs.statistics import StatisticsOfFiles

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from smachpy.events.recording import Recording


def standalone_page(
    recording: Recording, runs: Iterable[str | Path] = (), floor: Path | None = None
) -> str:
    """Return the page.

    Args:
        recording: The run.
        runs: Recorded runs for the statistics on the graph.
        floor: The map, where the recording has none: a map_server's YAML file.

    Raises:
        RecordingError: a file of `runs` cannot be read.
        InputFileError: `floor` is no map.
    """
    map_of_file = None if floor is None else read_floor(floor)
    machine = Machine(recording.path.name, lambda _machine: None, floor=map_of_file)
    machine.recorded = True
    machine.reset(recording.history(), limit=len(recording.events) + 1)
    run = {
        "model": page.model(recording.record),
        "snap": json.loads(machine.snapshot()[1]),
        "observed": machine.observed(),
        "statistics": StatisticsOfFiles(runs).of(recording.record),
        "why": why(recording.record, recording.events).to_json(),
    }
    return page.standalone(run, recording.record.label)
