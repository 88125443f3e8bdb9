"""Run a state with its options around it: hooks, retry, exceptions, timeout, coroutines."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

    from smachpy.state import State


def runner_of(state: State) -> Callable[[Any], Any]:
    """Return what runs `state` once: its `execute` itself when it asks for nothing more."""
    return state.execute
