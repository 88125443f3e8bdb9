"""Pictures of state machines: files, notebooks, the terminal.

Uses only introspection records (`smachpy.events.introspection`) and events (`smachpy.events`).

    from smachpy import viz

    viz.render(machine, "machine.svg")          # the structure
    history = viz.History()
    machine.subscribe(history.on_event)
    machine.execute()
    viz.render(machine, "run.svg", run=history)  # with the visits and transitions of the run

`render` and `picture` draw one picture, `atlas` one page per container, and `svg` returns the text
for a notebook. `TerminalView` shows a run while it happens, `MachineWidget` does so in a notebook.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from smachpy_viz.model.extract import UnknownPathError as UnknownPathError
    from smachpy_viz.model.history import History as History
    from smachpy_viz.notebook import MachineWidget as MachineWidget
    from smachpy_viz.pictures.drawing import PictureError as PictureError
    from smachpy_viz.pictures.drawing import atlas as atlas
    from smachpy_viz.pictures.drawing import picture as picture
    from smachpy_viz.pictures.drawing import render as render
    from smachpy_viz.pictures.drawing import svg as svg
    from smachpy_viz.pictures.graphviz_process import EngineError as EngineError
    from smachpy_viz.terminal.panel import TerminalView as TerminalView

__all__ = [
    "EngineError",
    "History",
    "MachineWidget",
    "PictureError",
    "TerminalView",
    "UnknownPathError",
    "atlas",
    "picture",
    "render",
    "svg",
]

_HOMES = {
    "EngineError": "smachpy_viz.pictures.graphviz_process",
    "History": "smachpy_viz.model.history",
    "MachineWidget": "smachpy_viz.notebook",
    "PictureError": "smachpy_viz.pictures.drawing",
    "TerminalView": "smachpy_viz.terminal.panel",
    "UnknownPathError": "smachpy_viz.model.extract",
    "atlas": "smachpy_viz.pictures.drawing",
    "picture": "smachpy_viz.pictures.drawing",
    "render": "smachpy_viz.pictures.drawing",
    "svg": "smachpy_viz.pictures.drawing",
}


# Imported on first use: `import viz` must not need the packages of every extra.
def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'viz' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
