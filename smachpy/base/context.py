"""The state that runs in this context; imported by all rooms, imports none of them."""

from __future__ import annotations

from contextvars import ContextVar
from typing import Any

THREAD: ContextVar[Any] = ContextVar("smachpy_thread", default=None)
"""The `smachpy.engine.frame.Frame` with which the thread of this context begins, or None.

Entering a container changes the attribute `innermost` of that frame, which takes a sixth of the
time of setting a context variable.
"""


def current_frame() -> Any:
    """Return the frame of the innermost container that runs in this context, or None."""
    first = THREAD.get()
    return None if first is None else first.innermost


def current_path() -> str:
    """Return the path of the state that runs in this context, or ""."""
    frame = current_frame()
    path: str = "" if frame is None else frame.here()
    return path


def is_left_behind() -> bool:
    """Return whether this thread was left behind; in a forked copy it was not, although dead."""
    first = THREAD.get()
    return first is not None and first.dead and first.ended
