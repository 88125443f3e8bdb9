"""Prints the table at the end of a run: states, outcomes, durations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Group
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from smachpy.events.run_state import RAISED
from smachpy_viz.model.labels import shorten
from smachpy_viz.terminal.lines import RUNNING, outcome_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.console import RenderableType

    from smachpy.events.introspection import StateRecord
    from smachpy_viz.model.history import History, Visits


def summary(
    record: StateRecord,
    history: History,
    outcome: str | None,
    most_rows: int,
    *,
    narrow: bool = False,
) -> RenderableType:
    """Return the table of visited states and a line with the mission's outcome.

    Args:
        record: The machine.
        history: The run.
        outcome: The mission's outcome; None if it raised.
        most_rows: The innermost levels are left out if the table would have more rows.
        narrow: Put a state's outcomes below its name.
    """
    visits = history.visits()
    states = [state for state in record.walk() if state.path in visits and state is not record]
    depth = _depth_that_fits([_depth(record, state) for state in states], most_rows)
    shown = [state for state in states if _depth(record, state) <= depth]
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    if narrow:
        table.add_column("state and outcomes")
        table.add_column("duration", justify="right", no_wrap=True)
    else:
        table.add_column("state", no_wrap=True, overflow="ellipsis")
        table.add_column("outcome")
        table.add_column("duration", justify="right", no_wrap=True, min_width=8)
        table.add_column("times", justify="right", no_wrap=True)
    for state in shown:
        _add(table, state, visits[state.path], _depth(record, state), narrow=narrow)
    parts: list[RenderableType] = ["", table] if shown else []
    if len(shown) < len(states):
        parts.append(Text(f"({len(states) - len(shown)} deeper states left out)", "dim"))
    return Group(*parts, "", _verdict(record, visits, history, outcome))


def _add(table: Table, state: StateRecord, visits: Visits, depth: int, *, narrow: bool) -> None:
    name = Text("  " * (depth - 1) + shorten(state.label), "bold" if state.children else "")
    ended = Text("running", RUNNING) if visits.since is not None else _outcomes(visits)
    times = f"\u00d7{visits.count}" if visits.count > 1 else ""
    if narrow:
        table.add_row(name, f"{visits.seconds:.1f} s")
        table.add_row(Padding(ended, (0, 0, 0, 2 * depth)), times)
    else:
        table.add_row(name, ended, f"{visits.seconds:.2f} s", times)


def _outcomes(visits: Visits) -> Text:
    """Return all outcomes of the state, with counts if there are several."""
    if len(visits.outcomes) == 1:
        return outcome_text(visits.outcome or "")
    return Text(", ").join(
        Text.assemble(outcome_text(outcome), (f" \u00d7{count}" if count > 1 else "", "dim"))
        for outcome, count in visits.outcomes.items()
    )


def _verdict(
    record: StateRecord, visits: Mapping[str, Visits], history: History, outcome: str | None
) -> Text:
    seconds = history.seconds
    took = "" if seconds is None or record.path not in visits else f" after {seconds:.2f} s"
    return Text.assemble(
        (shorten(record.label), "bold"), ": ", outcome_text(outcome or RAISED), took
    )


def _depth(record: StateRecord, state: StateRecord) -> int:
    return state.path.removeprefix(record.path).count("/")


def _depth_that_fits(depths: list[int], most: int) -> int:
    for depth in range(max(depths, default=1), 1, -1):
        if sum(1 for d in depths if d <= depth) <= most:
            return depth
    return 1
