"""Who asks for a preempt: said by those who know, found out for the rest.

A request is passed on to every active state in the thread that makes it, so what is said once
holds for all of them.
"""

from __future__ import annotations

import _signal  # type: ignore[import-not-found]  # `signal` without its enums
import contextlib
import functools
import inspect
import itertools
import signal
import sys
import threading
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any

from smachpy.context import current_frame
from smachpy.run.visit import Origin

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import CodeType, FrameType

    from actionlib_core.shutdown import Shutdown

_MOST_ARGUMENTS = 4  # of a handler: itself, the number, the interrupted frame, and one more

REQUESTING: ContextVar[object] = ContextVar("smachpy_requesting", default=None)
"""The state whose `request_preempt` runs here: a second call from within changes nothing."""


class _Said(threading.local):
    """What was said in this thread; not in the context, which tasks would inherit."""

    origin: Origin | None = None


_said = _Said()


@contextlib.contextmanager
def asking(source: str, by: str = "", why: str = "") -> Iterator[None]:
    """Say who asks for the preempts that this thread requests inside the `with` block.

    Inside another such block it changes nothing: the outer one knows where the wish came from.
    """
    before = _said.origin
    if before is None:
        _said.origin = Origin(source, by, why)
    try:
        yield
    finally:
        _said.origin = before


@contextlib.contextmanager
def shutdown_asking(shutdown: Shutdown) -> Iterator[None]:
    """Say that the program's end asks, and the signal that requested it."""
    reason = shutdown.reason or ""
    with asking("signal" if reason.startswith("SIG") else "shutdown", reason):
        yield


def current_origin() -> Origin:
    """Return who asks in this thread: what was said, else what can be seen."""
    said = _said.origin
    if said is not None:
        return said
    frame = current_frame()
    if frame is not None:
        return Origin("state", frame.here())
    return Origin("program", threading.current_thread().name)


def signal_being_handled() -> str:
    """Return the name of the signal whose handler, the program's own, is running here, or "".

    A handler is found by its code, or, when it has given the signal another handler already, by
    what Python calls it with: the number and the interrupted frame, which is its caller.
    """
    if threading.current_thread() is not threading.main_thread():
        return ""
    handlers: dict[CodeType, int] = {}
    for number in range(1, signal.NSIG):
        handler = _signal.getsignal(number)
        if handler is None or isinstance(handler, int):  # not Python's, ignored, or the default
            continue
        code = _code_of(handler)
        if code is not None:
            handlers[code] = number
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        found = handlers.get(frame.f_code)
        if found is None and frame.f_back is not None:
            found = _number_given(frame)
        if found is not None:
            return signal.Signals(found).name
        frame = frame.f_back
    return ""


def _code_of(handler: Any) -> CodeType | None:
    """Return the code of a handler: a function, a method, a partial, or an object to call."""
    while isinstance(handler, functools.partial):
        handler = handler.func
    function = getattr(handler, "__func__", handler)
    code = getattr(function, "__code__", None)
    if code is None and callable(handler):
        code = getattr(getattr(type(handler), "__call__", None), "__code__", None)  # noqa: B004
    return code


def _number_given(frame: FrameType) -> int | None:
    """Return the signal's number if `frame` was called as signal handlers are."""
    code = frame.f_code
    names = code.co_varnames[: code.co_argcount + bool(code.co_flags & inspect.CO_VARARGS)]
    if not names or len(names) > _MOST_ARGUMENTS:
        return None
    local = frame.f_locals
    given: list[Any] = []
    for name in names:
        value = local.get(name)
        given += value if isinstance(value, tuple) else [value]
    for number, interrupted in itertools.pairwise(given):
        if interrupted is frame.f_back and isinstance(number, int):
            return int(number) if number in signal.valid_signals() else None
    return None
