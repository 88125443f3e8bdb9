"""The errors of a run: a state's code that raised, an outcome that a child does not have."""

from __future__ import annotations

import sys
from types import CoroutineType
from typing import TYPE_CHECKING

from smachpy.base.problems import missing_init
from smachpy.exceptions import (
    InvalidStateError,
    InvalidTransitionError,
    InvalidUserCodeError,
    did_you_mean,
    error_text,
)

if TYPE_CHECKING:
    from collections.abc import Iterable


def user_error(path: str, state: object, error: BaseException) -> InvalidUserCodeError:
    """Return the error to raise, `from error`, when a state's code has raised."""
    hint = missing_init(state, error) if isinstance(error, AttributeError) else ""
    return raised(path, type(state).__name__, error, hint)


def error_of(error: BaseException) -> Exception | None:
    """Return the error of a state that raised `error`; None if that ends the program.

    A `CancelledError` of asyncio that a plain state lets out is an error like any other. It is no
    `Exception`, and outside of the state it would cancel what waits for the machine.
    """
    if isinstance(error, Exception):
        return error
    asyncio = sys.modules.get("asyncio")  # imported by who raises it; it takes 60 ms
    if asyncio is None or not isinstance(error, asyncio.CancelledError):
        return None
    made = RuntimeError("got a CancelledError of asyncio; expected an outcome.")
    made.__cause__ = error
    return made


def raised(path: str, what: str, error: BaseException, hint: str = "") -> InvalidUserCodeError:
    """Return the error to raise, `from error`, when `what`, the user's code, has raised."""
    text = f"{path}: {what} raised {error_text(error)}{hint}"
    return InvalidUserCodeError(text, path=path)


def unknown_outcome(path: str, outcomes: Iterable[str], got: object) -> InvalidTransitionError:
    """Return the error for a child that returned something other than one of its outcomes."""
    known = sorted(outcomes)
    hint = did_you_mean(got, known) if isinstance(got, str) else ""
    if got is None:
        hint = " Try a `return` at the end of every way through execute."
    elif isinstance(got, CoroutineType):
        got.close()
        hint = " Try `async def execute`, or `await` it."
    return InvalidTransitionError(
        f"{path}: unknown outcome: got {got!r}; expected one of {known}.{hint}"
    )


def already_runs(path: str) -> InvalidStateError:
    """Return the error for a second `execute` of the container at `path`."""
    return InvalidStateError(
        f"{path}: execute: got a second call while it runs; expected one run at a time."
    )
