"""`once`: a side effect of a state is not repeated when the state is executed again."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, TypeVar

from actionlib_core import border
from smachpy.base.context import current_frame
from smachpy.engine.frame import clock_of_run
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.engine.frame import Frame

R = TypeVar("R")


def once(key: str, call: Callable[[], R]) -> R:
    """Call `call` once in this visit of the state, and return its result from the journal later.

    In a durable run the result is in the journal before this function returns: a state that is
    executed again, by another process or by `retry`, gets it without a second call. The next visit
    of the state calls again. If the process ends after `call` has returned and before its result is
    in the journal, it is called again. Outside a durable run it is called each time; a run that is
    reproduced from its recording gets the recorded result.

    Args:
        key: A name for the call, unique within one visit of the state.
        call: A plain function without arguments.

    Returns:
        The result of `call`, which must be a value that a journal can keep.

    Raises:
        InvalidStateError: `key` is not a text, or `call` is a coroutine function.
        NotDurableError: the result cannot be kept; `call` was called.
        Exception: any that `call` raised; nothing is kept then.

    Blocks: during `call`, and until the journal is written.
    """
    if not isinstance(key, str) or not key:
        raise InvalidStateError(f"once: key: got {key!r}; expected a text that is not empty.")
    if not callable(call) or inspect.iscoroutinefunction(call):
        raise InvalidStateError(
            f"once: {key}: got {call!r}; expected a plain function that needs no arguments. Try "
            "`lambda: ...`."
        )
    frame: Frame | None = current_frame()
    if frame is None:
        return call()
    found: R = frame.run.journal.once(frame, key, call)
    if border.listeners:
        now = clock_of_run().now()
        for listener in border.listeners:
            listener(border.Crossing("once", frame.path, "", key, now, "", found))
    return found
