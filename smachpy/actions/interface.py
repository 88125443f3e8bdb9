"""Callbacks that declare outcomes and keys, and the states that adopt them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypedDict

from smachpy.machines.util import has_smach_interface

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from smachpy.machines.state import Grace, RetrySpec, State


class UntimedOptions(TypedDict, total=False):
    """`smachpy.machines.state.StateOptions` for states with their own argument `timeout`."""

    preempt_timeout: Grace
    retry: RetrySpec
    on_exception: Mapping[type[BaseException], str] | None
    on_enter: Callable[[Any], object] | None
    on_exit: Callable[[Any, Any], object] | None


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
