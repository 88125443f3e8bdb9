"""Writes mission coverage as a page: the figures, and each machine as a heat picture."""

from __future__ import annotations

import html
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from actionlib_core.process.output import printable
from smachpy.events import Entered, Event, Left
from smachpy.events.pictures import draw_run
from smachpy.testing.coverage import KINDS

if TYPE_CHECKING:
    from smachpy.testing.coverage import Coverage, Measured

_STYLE = """
body { font: 15px/1.5 sans-serif; margin: 2em auto; max-width: 70em; color: #222; }
table { border-collapse: collapse; } td, th { padding: .2em .8em; text-align: right; }
td:first-child, th:first-child { text-align: left; } tr + tr { border-top: 1px solid #ddd; }
td div { height: 1em; background: #d7301f; } td div div { background: #31a354; }
.cold { color: #b2182b; } svg { max-width: 100%; height: auto; }
"""
_HOTTEST = 5  # visits that the picture distinguishes; more look the same


def write_page(coverage: Coverage, file: Path) -> None:
    """Write the page, with pictures if a drawing package is installed."""
    parts = [
        "<!doctype html><html lang=en><meta charset=utf-8><title>Mission coverage</title>",
        f"<style>{_STYLE}</style><h1>Mission coverage</h1>",
    ]
    for machine in coverage.machines:
        parts += [_figures(machine), _heat(machine), _states(machine)]
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text("\n".join(parts), "utf-8")


def _figures(machine: Measured) -> str:
    cells = "".join(
        f"<tr><td>{kind}<td>{run}/{total}<td>{_bar(run, total)}"
        for kind in KINDS
        for run, total in [machine.counts(kind)]
    )
    name = html.escape(printable(machine.name))
    return f"<h2>{name}: {machine.percent:.0f} %, {machine.runs} runs</h2><table>{cells}</table>"


def _bar(run: int, total: int) -> str:
    share = 100 * run / total if total else 100
    return f'<div style="width:8em"><div style="width:{share:.0f}%"></div></div>'


def _heat(machine: Measured) -> str:
    """Return the machine as SVG, with states and edges marked by how often they ran."""
    with tempfile.TemporaryDirectory() as folder:
        drawn = draw_run(machine.record, _events(machine), Path(folder) / "heat.svg")
        if drawn is None:
            return ""
        text = drawn.read_text("utf-8")
    return text[text.index("<svg") :]


def _events(machine: Measured) -> list[Event]:
    """Return events from which a picture of the coverage can be drawn."""
    events: list[Event] = []
    for state in machine.record.walk():
        for outcome in state.outcomes:
            times = machine.taken["outcomes"].get(f"{state.path} -{outcome}->", 0)
            for _ in range(min(times, _HOTTEST)):
                events += [Entered(state.path, 0.0, 0), Left(state.path, 0.0, 0, outcome)]
    return events


def _states(machine: Measured) -> str:
    rows = []
    for state in machine.record.walk():
        times = machine.taken["states"].get(state.path, 0)
        missed = [o for o in state.outcomes if f"{state.path} -{o}->" in machine.missed("outcomes")]
        cold = "" if times else " class=cold"
        text = html.escape(printable(", ".join(missed)))
        rows.append(
            f"<tr{cold}><td>{html.escape(printable(state.path))}<td>{times}<td class=cold>{text}"
        )
    return "<table><tr><th>state<th>times<th>outcomes that never came" + "".join(rows) + "</table>"
