"""What runs in this context, as far as errors need to know: below everything else."""

from __future__ import annotations

from contextvars import ContextVar
from typing import Any

THREAD: ContextVar[Any] = ContextVar("smachpy_thread", default=None)
"""The `smachpy.run.frame.Frame` with which the thread of this context begins, or None.

Entering a container changes its attribute `innermost`, which takes a sixth of the time that a
context variable does.
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
