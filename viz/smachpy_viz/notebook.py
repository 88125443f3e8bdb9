"""Shows a running machine in a notebook.

    from smachpy import viz

    viz.MachineWidget(machine)      # as the last line of a cell

    machine.execute()               # in the next cell: the picture above is updated

The widget is an anywidget, for Jupyter, VS Code, Colab and marimo. `viz.svg` is a picture that is
not updated.
"""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.clock import RealClock, SerialExecutor
from smachpy.events.run_state import RAISED, innermost
from smachpy.exceptions import SmachError
from smachpy_viz.model.history import History
from smachpy_viz.model.labels import shorten
from smachpy_viz.pictures.drawing import PictureError, picture
from smachpy_viz.pictures.graphviz_process import until

try:
    import anywidget
    import traitlets
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"viz.MachineWidget: package {error.name!r} is missing. "
        "Try: pip install 'smachpy[notebook]'",
        name=error.name,
    ) from error

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.events import Event
    from smachpy.machines.container import Container

MAX_NAMES: Final = 6
CLOSE_S: Final = 2.0

# In an <img> an SVG runs no scripts and loads no files, whatever names are in it.
ESM: Final = """
function render({ model, el }) {
  const picture = document.createElement("img");
  const status = document.createElement("p");
  picture.style.maxWidth = "100%";
  status.setAttribute("role", "status");
  const show = () => {
    picture.src = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(model.get("picture"));
    picture.alt = status.textContent = model.get("status");
  };
  model.on("change:picture", show);
  model.on("change:status", show);
  show();
  el.replaceChildren(picture, status);
  return () => {
    model.off("change:picture", show);
    model.off("change:status", show);
  };
}
export default { render };
"""


class MachineWidget(anywidget.AnyWidget):
    """Shows a machine of this process and its running states.

    Args:
        machine: The machine; its runs are shown until `close`.
        theme: "light" or "dark".
        depth: Number of open levels; None for all.
        interval: Shortest time between two pictures [s].

    Attributes:
        picture: The newest picture, as SVG.
        status: The running states or the outcome; or why there is no newer picture.

    Raises:
        PictureError: `interval` is not a positive time, or there is no such theme.
        EngineError: `dot` is not available.

    Threads: pictures are drawn in another thread, which exists only while there are events; the
        machine's threads only add their events to the history.
    """

    _esm = ESM
    picture = traitlets.Unicode("").tag(sync=True)
    status = traitlets.Unicode("").tag(sync=True)
    _forget: Callable[[], object] | None = None
    _executor: SerialExecutor | None = None

    def __init__(
        self,
        machine: Container,
        *,
        theme: str = "light",
        depth: int | None = None,
        interval: float = 0.25,
    ) -> None:
        super().__init__()
        if not 0.0 < interval < math.inf:
            raise PictureError(f"interval: got {interval:g}; expected more than 0 [s].")
        self._machine = machine
        self._looks: dict[str, Any] = {"theme": theme, "depth": depth}
        self._interval = interval
        self._history = History()
        self._clock = RealClock()  # `interval` is for people, also if the machine's time is virtual
        self._closed = self._clock.event()
        self._executor = SerialExecutor(self._clock, "pictures of a notebook")
        self._lock = threading.Lock()
        self._is_due = False  # whether a drawing is submitted that has not begun
        self._draw()
        self._forget = machine.subscribe(self._on_event)

    def close(self) -> None:
        """Stop showing the machine; a second call does nothing.

        A picture that is being drawn is given up.

        Blocks: until that has happened, at most 2 s.
        """
        if self._forget is not None:  # ipywidgets also closes a widget whose __init__ raised
            self._forget()
        if self._executor is not None:
            self._closed.set()
            self._executor.join(CLOSE_S)
        super().close()

    def _on_event(self, event: Event) -> None:
        self._history.on_event(event)
        with self._lock:
            if self._is_due:
                return
            self._is_due = True
        if self._executor is not None:
            self._executor.submit(self._follow)

    def _follow(self) -> None:
        """Draw the newest state, then wait: events meanwhile make one further drawing."""
        with self._lock:  # cleared before drawing: an event during it is not in the picture
            self._is_due = False
        if self._closed.is_set():
            return
        try:
            with until(self._closed):
                self._draw()
        except SmachError as error:  # shown, because nobody calls this thread's function
            if not self._closed.is_set():
                self.status = str(error)
        self._closed.wait(self._interval)

    def _draw(self) -> None:
        drawn = picture(self._machine, "svg", run=self._history, **self._looks)
        if self._closed.is_set():
            return
        self.status = _status(self._history)
        self.picture = drawn.decode("utf-8", "replace")


def _status(history: History) -> str:
    """Return the running states, or the outcome, as text."""
    if leaves := innermost(history.active()):
        names = [shorten(path.rpartition("/")[2]) for path in leaves[:MAX_NAMES]]
        more = len(leaves) - len(names)
        return f"running: {', '.join(names)}{f' and {more} more' if more else ''}"
    visits = history.visits()
    if not visits:
        return "not started"
    root = min(visits, key=len)  # the shortest path
    return f"ended: {shorten(visits[root].outcome or RAISED)} after {history.seconds or 0.0:.1f} s"
