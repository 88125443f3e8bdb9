"""Pictures of state machines: files, notebooks, the terminal.

Uses only introspection records (`smachpy.introspection`) and events (`smachpy.events`).

    import viz

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
    from viz.model.extract import UnknownPathError as UnknownPathError
    from viz.model.history import History as History
    from viz.notebook import MachineWidget as MachineWidget
    from viz.pictures.drawing import PictureError as PictureError
    from viz.pictures.drawing import atlas as atlas
    from viz.pictures.drawing import picture as picture
    from viz.pictures.drawing import render as render
    from viz.pictures.drawing import svg as svg
    from viz.pictures.graphviz_process import EngineError as EngineError
    from viz.terminal.panel import TerminalView as TerminalView

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
    "EngineError": "viz.pictures.graphviz_process",
    "History": "viz.model.history",
    "MachineWidget": "viz.notebook",
    "PictureError": "viz.pictures.drawing",
    "TerminalView": "viz.terminal.panel",
    "UnknownPathError": "viz.model.extract",
    "atlas": "viz.pictures.drawing",
    "picture": "viz.pictures.drawing",
    "render": "viz.pictures.drawing",
    "svg": "viz.pictures.drawing",
}


# Imported on first use: `import viz` must not need the packages of every extra.
def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'viz' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
