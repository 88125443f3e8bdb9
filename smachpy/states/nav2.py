"""A state that waits until a robot's navigation is ready."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import ros2
from smachpy.actions.service_state import ServiceState
from smachpy.machines.state_machine import StateMachine
from smachpy.states.waiting import Wait

if TYPE_CHECKING:
    from smachpy.userdata.user_data import UserData

ASKED_EVERY_S = 1.0
ANSWER_S = 5.0


def nav2_active(
    *, manager: str = "lifecycle_manager_navigation", timeout: float = 60.0
) -> StateMachine:
    """Return a machine that waits until Nav2 is active.

    Outcomes: 'succeeded', 'aborted', 'preempted'.

    It asks Nav2's lifecycle manager (`<manager>/is_active`) once a second, like Nav2's own
    programs, because the manager does not announce when it is done. 'aborted': not active within
    `timeout`.

    Args:
        manager: Name of the manager's node; "lifecycle_manager_localization" is another.
        timeout: Longest wait [s].
    """

    def on_response(_userdata: UserData, response: Any) -> str:
        return "succeeded" if response.success else "aborted"

    machine = StateMachine(
        outcomes=["succeeded", "aborted", "preempted"], timeout=timeout, timeout_outcome="aborted"
    )
    trigger = ros2.get_service("std_srvs/Trigger")
    ask = ServiceState(f"{manager}/is_active", trigger, response_cb=on_response, timeout=ANSWER_S)
    machine.add("ASK", ask, {"succeeded": "succeeded", "aborted": "WAIT", "preempted": "preempted"})
    machine.add("WAIT", Wait(ASKED_EVERY_S), {"done": "ASK", "preempted": "preempted"})
    return machine
