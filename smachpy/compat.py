"""SMACH's module names: `from smachpy.state_machine import StateMachine` works as in SMACH."""

from __future__ import annotations

from typing import Final

MODULES: Final = {
    "smachpy.action_server_wrapper": "smachpy.actions.action_server_wrapper",
    "smachpy.concurrence": "smachpy.machines.concurrence",
    "smachpy.condition_state": "smachpy.actions.condition_state",
    "smachpy.container": "smachpy.machines.container",
    "smachpy.iterator": "smachpy.machines.iterator",
    "smachpy.monitor_state": "smachpy.actions.monitor_state",
    "smachpy.sequence": "smachpy.machines.state_machine",
    "smachpy.service_state": "smachpy.actions.service_state",
    "smachpy.simple_action_state": "smachpy.actions.simple_action_state",
    "smachpy.state": "smachpy.machines.state",
    "smachpy.state_machine": "smachpy.machines.state_machine",
    "smachpy.user_data": "smachpy.userdata.user_data",
}
"""The module names of SMACH and smach_ros, under this package's name -> module here."""
