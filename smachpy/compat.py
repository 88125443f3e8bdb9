"""SMACH's module names: `from smachpy.state_machine import StateMachine` works as in SMACH."""

from __future__ import annotations

from typing import Final

MODULES: Final = {
    "smachpy.action_server_wrapper": "smachpy.actions.action_server_wrapper",
    "smachpy.checks.cli": "smachpy.command.check",
    "smachpy.concurrence": "smachpy.machines.concurrence",
    "smachpy.condition_state": "smachpy.actions.condition_state",
    "smachpy.container": "smachpy.machines.container",
    "smachpy.events.control": "smachpy.engine.control",
    "smachpy.introspection": "smachpy.events.introspection",
    "smachpy.iterator": "smachpy.machines.iterator",
    "smachpy.log": "smachpy.base.log",
    "smachpy.monitor_state": "smachpy.actions.monitor_state",
    "smachpy.sequence": "smachpy.machines.state_machine",
    "smachpy.service_state": "smachpy.actions.service_state",
    "smachpy.simple_action_state": "smachpy.actions.simple_action_state",
    "smachpy.sim.config": "smachpy.places.robot_file",
    "smachpy.sim.exceptions": "smachpy.places.exceptions",
    "smachpy.sim.geometry": "smachpy.places.pose",
    "smachpy.sim.maps": "smachpy.places.maps",
    "smachpy.sim.occupancy": "smachpy.places.occupancy",
    "smachpy.state": "smachpy.machines.state",
    "smachpy.state_machine": "smachpy.machines.state_machine",
    "smachpy.user_data": "smachpy.userdata.user_data",
    "smachpy.util": "smachpy.machines.util",
}
"""Names of modules in SMACH, smach_ros and earlier versions -> module here."""
