"""`once`: what a state does to the world is not done twice because its process ended."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, TypeVar

from smachpy.context import current_frame
from smachpy.exceptions import InvalidStateError

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.run.frame import Frame

R = TypeVar("R")


def once(key: str, call: Callable[[], R]) -> R:
    """Return what `call` returns, from the journal if it has returned in this visit before.

    In a durable run the result is kept before this returns: a state that is executed again, by
    another process or by `retry`, gets it without a second call. The next visit of the state calls
    anew. If the process ends after `call` has returned and before its result is kept, it is called
    again. Outside a durable run it is called each time.

    Args:
        key: What to call it; within one visit of a state.
        call: Does it; a plain function.

    Returns:
        Its result, which must be a value that can be kept.

    Raises:
        InvalidStateError: `key` is no text, or `call` a coroutine function.
        NotDurableError: the result cannot be kept; `call` was called.
        Exception: what `call` raised; nothing is kept then.

    Blocks: as long as `call`, and for the journal.
    """
    if not isinstance(key, str) or not key:
        raise InvalidStateError(f"once: key: got {key!r}; expected a text that is not empty.")
    if not callable(call) or inspect.iscoroutinefunction(call):
        raise InvalidStateError(
            f"once: {key}: got {call!r}; expected a plain function that needs no arguments. Try "
            "`lambda: ...`."
        )
    frame: Frame | None = current_frame()
    if frame is None or frame.run.journal is None:
        return call()
    found: R = frame.run.journal.once(frame, key, call)
    return found
