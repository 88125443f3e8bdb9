"""Shows a run in the terminal while it happens.

    with TerminalView(describe(machine)) as view:
        unsubscribe = machine.subscribe(view.on_event)
        try:
            outcome = machine.execute()
        finally:
            unsubscribe()
    view.print_summary(outcome)

In a terminal, each transition becomes a permanent line above a panel with the running states, the
goals with feedback, progress, distance and time left, and the userdata written last. Without a
terminal, or with `plain=True`, there are only the lines. The mission never waits for the terminal:
events are kept in memory and a task of the clock draws them; a terminal that blocks (Ctrl-S, a slow
link) loses lines, but costs the mission no time.
"""

from __future__ import annotations

import errno
import io
import reprlib
import sys
import threading
from collections import deque
from typing import TYPE_CHECKING, Self

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from actionlib_core.clock import current_clock
from smachpy.events.run_state import innermost
from smachpy.userdata.secret import masked
from smachpy.userdata.shown import brief, is_shown
from smachpy_viz.model.history import History
from smachpy_viz.model.labels import GLYPHS, cleanups, shorten, tidies
from smachpy_viz.model.progress import progress_of, seconds_left, written_progress
from smachpy_viz.terminal.lines import NARROW, RUNNING, STYLES, EventLines

if TYPE_CHECKING:
    from rich.console import RenderableType

    from actionlib_core.clock import Clock, Task
    from smachpy import events as ev
    from smachpy.events.introspection import StateRecord
    from smachpy_viz.model.history import RunningGoal
    from smachpy_viz.model.progress import Written

FRAME = 0.1
"""Shortest time between two updates [s]."""
TICK = 0.5
"""Longest time between two updates of the panel, which shows running seconds [s]."""
BACKLOG = 2000
"""Most lines that wait for a slow terminal; the oldest are dropped first."""
PATIENCE = 2.0
"""Longest wait for a blocked terminal at the end [s]."""
MAX_KEYS = 5
"""Userdata keys in the panel, the most recently written ones."""
VALUE_LENGTH = 60
MAX_ROWS = 40
"""Rows of the table at the end; deeper levels are left out if there are more."""

_REPR = reprlib.Repr()
_REPR.maxother = _REPR.maxstring = VALUE_LENGTH


class TerminalView:
    """Shows one machine's run; a context manager.

    Args:
        record: The machine's structure.
        plain: Only lines, no panel. Output that is not a terminal is always plain.
        console: Where to draw; standard output by default.
        clock: The machine's clock; the current one by default.
        drawing: The clock for updates, if the machine's runs faster than real time; the machine's
            by default.

    Attributes:
        history: The events so far, also for `viz.render(..., run=view.history)`.

    Threads: `on_event` may be called from any thread and never waits for the terminal.
    """

    def __init__(
        self,
        record: StateRecord,
        *,
        plain: bool = False,
        console: Console | None = None,
        clock: Clock | None = None,
        drawing: Clock | None = None,
    ) -> None:
        self.history = History()
        self._record = record
        self._cleanups = cleanups(record)
        self._kinds = {state.path: state.kind for state in record.walk() if not state.children}
        self._console = console or _standard_output()
        self._clock = clock or current_clock()
        self._drawing = drawing or self._clock
        panel = self._console.is_terminal and not plain
        self._live = _live_panel(self._console) if panel else None
        self._event_lines = EventLines(
            record, self.history, panel=panel, narrow=self._console.width < NARROW
        )
        self._lock = threading.Lock()
        self._lines: deque[Text] = deque(maxlen=BACKLOG)
        self._lost = 0
        self._wake = self._drawing.event()
        self._closing = False
        self._gone = False
        self._task: Task | None = None

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        self._task = self._drawing.spawn(self._draw, name="terminal view")
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Draw the remaining lines and restore the terminal; a second call does nothing.

        Blocks: until that is done, at most 2 s if the terminal blocks.
        """
        task, self._task = self._task, None
        if task is None:
            return
        self._closing = True
        self._wake.set()
        task.join(PATIENCE)

    def on_event(self, event: ev.Event) -> None:
        """Process one event; for `machine.subscribe`."""
        line = self._event_lines.line(event)
        self.history.on_event(event)
        if line is not None and not self._gone:
            with self._lock:
                self._lost += len(self._lines) == BACKLOG
                self._lines.append(line)
        if line is not None or self._live is not None:
            self._wake.set()

    def print_summary(self, outcome: str | None) -> None:
        """Print the table of states and the mission's outcome; None: the mission raised.

        Raises:
            BrokenPipeError: standard output has been closed.

        Blocks: while the terminal takes the text.
        """
        from smachpy_viz.terminal.summary import summary

        self.close()
        narrow = self._console.width < NARROW
        self._console.print(summary(self._record, self.history, outcome, MAX_ROWS, narrow=narrow))

    def _draw(self) -> None:
        """Draw in a task of its own: woken by events, at most ten times per second."""
        try:
            while not self._closing:
                self._wake.wait(TICK if self._live is not None else None)
                self._wake.clear()
                self._frame()
                if not self._closing:
                    self._drawing.sleep(FRAME)
            self._frame()
            self._release()
        except (OSError, SystemExit):  # a closed pipe or a lost login does not stop the mission
            self._gone = True
        except BaseException:
            self._release()
            raise

    def _release(self) -> None:
        if self._live is not None:
            self._live.stop()

    def _frame(self) -> None:
        with self._lock:
            lines, lost = list(self._lines), self._lost
            self._lines.clear()
            self._lost = 0
        if lost:
            self._console.print(Text(f"({lost} lines left out: the terminal was too slow)", "dim"))
        for line in lines:
            self._console.print(line, soft_wrap=self._live is None)
        if self._live is not None:
            self._live.update(Text() if self._closing else self._panel(), refresh=True)

    def _panel(self) -> RenderableType:
        now = self._clock.now()
        started = self.history.started
        title = shorten(self._record.label)
        if started is not None:
            title += f"  {_span(now - started)}"
        parts: list[RenderableType] = [Rule(Text(title, "bold"), align="left", style=RUNNING)]
        parts += [self._active(path, now - since) for path, since in self._running()]
        goals = self.history.goals()
        if goals:
            parts.append(self._goals(goals, now))
        parts += self._userdata()
        return Group(*parts)

    def _userdata(self) -> list[RenderableType]:
        """Return the userdata written last, one key per line, newest first."""
        table = Table.grid(padding=(0, 2))
        bars = Table.grid(padding=(0, 2), expand=False)
        for key, value in self.history.written(MAX_KEYS):
            progress = written_progress(value)
            if progress is not None:
                bars.add_row(*self._bar(key, progress))
                continue
            # In the mission's own process the values are its objects, else those of records.
            whole = brief(value) if is_shown(value) else _REPR.repr(masked(value, key))
            text = shorten(whole, VALUE_LENGTH)
            table.add_row(Text(f"  {shorten(key, 24)}", "dim"), Text(text, no_wrap=True))
        return [part for part in (bars, table) if part.row_count]

    def _bar(self, key: str, progress: Written) -> list[RenderableType]:
        """Return a row for the progress that the mission itself reports."""
        share, seconds = progress.fraction, progress.seconds_left
        cells: list[RenderableType] = [Text(f"  {shorten(key, 24)}", no_wrap=True)]
        if self._console.width >= NARROW and share is not None:
            cells.append(
                ProgressBar(total=1.0, completed=share, width=20, complete_style=STYLES["success"])
            )
        cells.append(Text("" if share is None else f"{share:4.0%}"))
        cells.append(Text("" if seconds is None else f"~{_span(seconds)}", no_wrap=True))
        cells.append(Text(shorten(progress.text), no_wrap=True, overflow="ellipsis"))
        return cells

    def _running(self) -> list[tuple[str, float]]:
        """Return the running states that contain no other running state."""
        active = self.history.active()
        return [(path, active[path]) for path in innermost(active)]

    def _active(self, path: str, seconds: float) -> Text:
        names = [shorten(name) for name in path.strip("/").split("/")]
        glyph = GLYPHS.get(self._kinds.get(path, ""), "\u25cf")
        trail = " \u203a ".join(names[:-1])
        line = Text.assemble(
            (f"{glyph} ", RUNNING),
            (f"{trail} \u203a " if trail else "", "dim"),
            (names[-1], f"bold {RUNNING}"),
            (", tidying up" if tidies(path, self._cleanups) else "", ""),
            (f"  {_span(seconds)}", "dim"),
        )
        line.no_wrap = True
        line.overflow = "ellipsis"
        return line

    def _goals(self, goals: list[RunningGoal], now: float) -> Table:
        wide = self._console.width >= NARROW
        table = Table.grid(padding=(0, 2), expand=False)
        for goal in goals:
            progress = progress_of(goal.goal, goal.feedback, goal.first_feedback)
            cells: list[RenderableType] = [Text(f"  {shorten(goal.action, 24)}", no_wrap=True)]
            if wide:
                fraction = progress.fraction
                cells.append(
                    Text("")
                    if fraction is None
                    else ProgressBar(
                        total=1.0, completed=fraction, width=20, complete_style=RUNNING
                    )
                )
                cells.append(Text("" if fraction is None else f"{fraction:4.0%}"))
            left = "" if progress.distance is None else f"{progress.distance:.2f} m left"
            cells.append(Text(left, "bold", no_wrap=True))
            seconds = seconds_left(goal.feedback, progress.fraction, now - goal.since)
            cells.append(Text("" if seconds is None else f"~{_span(seconds)}", no_wrap=True))
            cells.append(Text(shorten(progress.text), "dim", no_wrap=True, overflow="ellipsis"))
            table.add_row(*cells)
        return table


def _standard_output() -> Console:
    # An ASCII terminal gets question marks instead of an error for the first arrow.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")
    return _Output(highlight=False)


class _Output(Console):
    """A console that raises on a closed pipe; rich's own would end the process."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError(errno.EPIPE, "nobody reads standard output any more")


def _live_panel(console: Console) -> Live:
    return Live(console=console, auto_refresh=False, transient=True, redirect_stderr=True)


def _span(seconds: float) -> str:
    """Return a duration for reading: `3.2 s`, `2:05`, `1:02:05`."""
    if seconds < 60:  # noqa: PLR2004  a minute
        return f"{seconds:.1f} s"
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
