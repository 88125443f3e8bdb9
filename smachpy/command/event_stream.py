"""Writes a run's events as lines of JSON to a stream, for example to standard output."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING, Self

from actionlib_core.clock import RealClock, SerialExecutor
from smachpy.events import to_record
from smachpy.events.recording import event_line, header_line
from smachpy.events.steady import SteadyStamps

if TYPE_CHECKING:
    from typing import TextIO

    from smachpy import events as ev
    from smachpy.events.introspection import StateRecord

CLOSE_S = 10.0
"""Longest wait at the end for a slow reader [s]."""


class EventStream:
    """Writes every event at once, in the format of a recorded run; a context manager.

    The mission never waits for the reader.

    Args:
        out: The stream.
        record: The machine's structure.
        stamp_ns: When the run began [ns since the epoch].

    Threads: `on_event` may be called from any thread.
    """

    def __init__(self, out: TextIO, record: StateRecord, stamp_ns: int) -> None:
        self._header = header_line(record, stamp_ns)
        self._out = out
        # Real time: a slow reader is slow in real time, even if the mission's clock is virtual.
        self._executor = SerialExecutor(RealClock(), "events")
        self._lock = threading.Lock()
        self._waiting: deque[str] = deque()
        self._scheduled = False
        self._number = 0
        self._steady = SteadyStamps()
        self._gone = False

    def __enter__(self) -> Self:
        self._put(self._header)
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Write the remaining lines; a second call does nothing.

        Blocks: for `CLOSE_S` seconds at most.
        """
        self._executor.join(CLOSE_S)

    def on_event(self, event: ev.Event) -> None:
        """Process one event; for `machine.subscribe`."""
        record = to_record(event)
        with self._lock:
            self._number += 1
            line = event_line({**self._steady.fix(record), "seq": self._number})
        self._put(line)

    def print_summary(self, outcome: str | None) -> None:
        """Print nothing: the last event has the outcome."""

    def _put(self, line: str) -> None:
        with self._lock:
            if self._gone:
                return
            self._waiting.append(line)
            scheduled, self._scheduled = self._scheduled, True
        if not scheduled:
            self._executor.submit(self._write)

    def _write(self) -> None:
        with self._lock:
            lines = list(self._waiting)
            self._waiting.clear()
            self._scheduled = False
        try:
            self._out.write("".join(lines))
            self._out.flush()
        except (OSError, ValueError):  # the reader is gone: the mission continues without it
            self._gone = True
