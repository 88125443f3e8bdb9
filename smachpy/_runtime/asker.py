"""Who asks for a preempt: said by those who know, found out for the rest.

A request is passed on to every active state in the thread that makes it, so what is said once
holds for all of them.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
from typing import TYPE_CHECKING, NamedTuple

from smachpy._runtime.frame import FRAME

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import CodeType

    from actionlib_core.shutdown import Shutdown


class Asker(NamedTuple):
    """Who asked, as `smachpy.events.PreemptRequested` tells it."""

    source: str
    by: str = ""
    why: str = ""


class _Said(threading.local):
    """What was said in this thread; not in the context, which tasks would inherit."""

    asker: Asker | None = None


_said = _Said()


@contextlib.contextmanager
def asking(source: str, by: str = "", why: str = "") -> Iterator[None]:
    """Say who asks for the preempts that this thread requests inside the `with` block.

    Inside another such block it changes nothing: the outer one knows where the wish came from.
    """
    before = _said.asker
    if before is None:
        _said.asker = Asker(source, by, why)
    try:
        yield
    finally:
        _said.asker = before


@contextlib.contextmanager
def shutdown_asking(shutdown: Shutdown) -> Iterator[None]:
    """Say that the program's end asks, and the signal that requested it."""
    reason = shutdown.reason or ""
    with asking("signal" if reason.startswith("SIG") else "shutdown", reason):
        yield


def current_asker() -> Asker:
    """Return who asks in this thread: what was said, else what can be seen."""
    said = _said.asker
    if said is not None:
        return said
    name = _signal_being_handled()
    if name:
        return Asker("signal", name)
    frame = FRAME.get()
    if frame is not None:
        return Asker("state", frame.here())
    return Asker("program", threading.current_thread().name)


def _signal_being_handled() -> str:
    """Return the name of the signal whose handler, the program's own, is running here, or ""."""
    if threading.current_thread() is not threading.main_thread():
        return ""
    handlers: dict[CodeType, signal.Signals] = {}
    for number in signal.valid_signals():
        handler = signal.getsignal(number)
        function = getattr(handler, "__func__", handler)
        code = getattr(function, "__code__", None)
        if code is not None:
            handlers[code] = signal.Signals(number)
    frame = sys._getframe() if handlers else None  # noqa: SLF001  the documented way
    while frame is not None:
        if frame.f_code in handlers:
            return handlers[frame.f_code].name
        frame = frame.f_back
    return ""
