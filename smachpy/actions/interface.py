"""Callbacks that declare outcomes and keys, and the states that adopt them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from smachpy.machines.state import CommonOptions
from smachpy.machines.util import has_smach_interface

if TYPE_CHECKING:
    from smachpy.machines.state import Grace, State


class UntimedOptions(CommonOptions, total=False):
    """`smachpy.machines.state.StateOptions` for states with their own argument `timeout`."""

    preempt_timeout: Grace


def adopt_interface(state: State, callback: object, *, outcomes: bool = True) -> None:
    """Add the keys and outcomes that `callback` declares with `cb_interface`.

    Args:
        state: The state that gets them.
        callback: The callback, or None.
        outcomes: Whether to add the outcomes: the callback chooses the state's outcome.
    """
    interface: Any = callback
    if has_smach_interface(callback):
        state.register_input_keys(interface.get_registered_input_keys())
        state.register_output_keys(interface.get_registered_output_keys())
        if outcomes:
            state.register_outcomes(interface.get_registered_outcomes())
