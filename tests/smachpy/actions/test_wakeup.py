"""Blocking calls of states."""

from __future__ import annotations

import pytest

from smachpy import State
from smachpy.actions.wakeup import PreemptedError, call_blocking


def test_nothing_is_called_for_a_state_that_was_asked_to_stop_before():
    """A life cycle was still moved if the preempt came between two answers of the node."""
    state, called = State(["done"]), []
    state.request_preempt()
    with pytest.raises(PreemptedError):
        call_blocking(state, lambda: called.append("call"), lambda: called.append("stop"), "call")
    assert called == []
    assert not state.preempt_requested()
