"""What the processes of the campaign write down: one line per event, whole even after kill -9."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path


class Journal:
    """Appends events to a file; each is written at once and by one call of the system.

    Times are those of the computer's monotonic clock [s], which all its processes share.
    """

    def __init__(self, path: str | Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)

    def write(self, event: str, **data: object) -> None:
        line = json.dumps({"t": time.monotonic(), "event": event, **data})
        os.write(self._file, line.encode() + b"\n")


def read(path: Path) -> Iterator[dict]:
    """Yield the events of a journal."""
    with path.open() as lines:
        for line in lines:
            yield json.loads(line)
