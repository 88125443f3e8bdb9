"""Robot missions as state machines: SMACH's names, without ROS and without its hangs.

    import smachpy

    class Drive(smachpy.State):
        def __init__(self):
            super().__init__(outcomes=["arrived", "blocked"])

        def execute(self, userdata):
            return "arrived"

    sm = smachpy.StateMachine(outcomes=["done", "failed"])
    with sm:
        smachpy.StateMachine.add("DRIVE", Drive(), {"arrived": "done", "blocked": "failed"})
    sm.execute()

`import smachpy as smach` and `import smachpy as smach_ros` run existing programs. The states that
talk to action servers, services and topics are imported when they are first used.
"""

from __future__ import annotations

import sys as _sys
from typing import TYPE_CHECKING, Any

from actionlib_core.compat import alias_modules as _alias_modules
from smachpy.base.log import logdebug as logdebug
from smachpy.base.log import logerr as logerr
from smachpy.base.log import loginfo as loginfo
from smachpy.base.log import logwarn as logwarn
from smachpy.base.log import set_loggers as set_loggers
from smachpy.compat import MODULES as _SMACH_MODULES
from smachpy.engine.cleanup import Ending as Ending
from smachpy.engine.cleanup import current_ending as current_ending
from smachpy.engine.options import Resource as Resource
from smachpy.engine.options import Retry as Retry
from smachpy.exceptions import InconsistentMachineError as InconsistentMachineError
from smachpy.exceptions import InvalidConstructionError as InvalidConstructionError
from smachpy.exceptions import InvalidStateError as InvalidStateError
from smachpy.exceptions import InvalidTransitionError as InvalidTransitionError
from smachpy.exceptions import InvalidUserCodeError as InvalidUserCodeError
from smachpy.exceptions import ReadOnlyError as ReadOnlyError
from smachpy.exceptions import SmachError as SmachError
from smachpy.exceptions import UserDataKeyError as UserDataKeyError
from smachpy.exceptions import UserDataTypeError as UserDataTypeError
from smachpy.machines.concurrence import Concurrence as Concurrence
from smachpy.machines.concurrence import Rule as Rule
from smachpy.machines.concurrence import all_of as all_of
from smachpy.machines.concurrence import any_of as any_of
from smachpy.machines.concurrence import n_of as n_of
from smachpy.machines.container import Container as Container
from smachpy.machines.guards import When as When
from smachpy.machines.guards import when as when
from smachpy.machines.iterator import Iterator as Iterator
from smachpy.machines.mission_info import mission as mission
from smachpy.machines.preempt_handler import set_preempt_handler as set_preempt_handler
from smachpy.machines.state import CBState as CBState
from smachpy.machines.state import Options as Options
from smachpy.machines.state import State as State
from smachpy.machines.state import current_state as current_state
from smachpy.machines.state import get_options as get_options
from smachpy.machines.state import set_options as set_options
from smachpy.machines.state import state as state
from smachpy.machines.state_machine import Sequence as Sequence
from smachpy.machines.state_machine import StateMachine as StateMachine
from smachpy.machines.util import CBInterface as CBInterface
from smachpy.machines.util import cb_interface as cb_interface
from smachpy.machines.util import has_smach_interface as has_smach_interface
from smachpy.machines.util import is_shutdown as is_shutdown
from smachpy.machines.util import set_shutdown_check as set_shutdown_check
from smachpy.userdata.secret import Secret as Secret
from smachpy.userdata.user_data import Remapper as Remapper
from smachpy.userdata.user_data import UserData as UserData

if TYPE_CHECKING:
    from smachpy.actions.action_server_wrapper import ActionServerWrapper as ActionServerWrapper
    from smachpy.actions.condition_state import ConditionState as ConditionState
    from smachpy.actions.monitor_state import MonitorState as MonitorState
    from smachpy.actions.service_state import ServiceState as ServiceState
    from smachpy.actions.simple_action_state import SimpleActionState as SimpleActionState
    from smachpy.checks import check as check
    from smachpy.durable.codec import NotDurableError as NotDurableError
    from smachpy.durable.mission import run_durable as run_durable
    from smachpy.durable.once import once as once
    from smachpy.events.introspection import Kind as Kind
    from smachpy.events.introspection import StateRecord as StateRecord
    from smachpy.events.introspection import describe as describe
    from smachpy.files.reading import load as load
    from smachpy.network.client import IntrospectionClient as IntrospectionClient
    from smachpy.network.server import IntrospectionServer as IntrospectionServer
    from smachpy.userdata.kept_types import register_type as register_type
    from smachpy.viz import render as render

__all__ = [
    "ActionServerWrapper",
    "CBInterface",
    "CBState",
    "Concurrence",
    "ConditionState",
    "Container",
    "Ending",
    "InconsistentMachineError",
    "IntrospectionClient",
    "IntrospectionServer",
    "InvalidConstructionError",
    "InvalidStateError",
    "InvalidTransitionError",
    "InvalidUserCodeError",
    "Iterator",
    "Kind",
    "MonitorState",
    "NotDurableError",
    "Options",
    "ReadOnlyError",
    "Remapper",
    "Resource",
    "Retry",
    "Rule",
    "Secret",
    "Sequence",
    "ServiceState",
    "SimpleActionState",
    "SmachError",
    "State",
    "StateMachine",
    "StateRecord",
    "UserData",
    "UserDataKeyError",
    "UserDataTypeError",
    "When",
    "all_of",
    "any_of",
    "cb_interface",
    "current_ending",
    "current_state",
    "describe",
    "get_options",
    "has_smach_interface",
    "is_shutdown",
    "load",
    "logdebug",
    "logerr",
    "loginfo",
    "logwarn",
    "mission",
    "n_of",
    "once",
    "register_type",
    "render",
    "run_durable",
    "set_loggers",
    "set_options",
    "set_preempt_handler",
    "set_shutdown_check",
    "state",
    "when",
]

# Names that a plain machine does not need -> module that defines them; imported on first use.
_LAZY: dict[str, str] = {
    "ActionServerWrapper": "smachpy.actions.action_server_wrapper",
    "ConditionState": "smachpy.actions.condition_state",
    "IntrospectionClient": "smachpy.network.client",
    "IntrospectionServer": "smachpy.network.server",
    "Kind": "smachpy.events.introspection",
    "MonitorState": "smachpy.actions.monitor_state",
    "NotDurableError": "smachpy.durable.codec",
    "ServiceState": "smachpy.actions.service_state",
    "SimpleActionState": "smachpy.actions.simple_action_state",
    "StateRecord": "smachpy.events.introspection",
    "check": "smachpy.checks",
    "describe": "smachpy.events.introspection",
    "load": "smachpy.files.reading",
    "once": "smachpy.durable.once",
    "register_type": "smachpy.userdata.kept_types",
    "render": "smachpy.viz",
    "run_durable": "smachpy.durable.mission",
}


_alias_modules(_SMACH_MODULES)
# Importing a submodule sets an attribute of its package. `smachpy.state` is the decorator, so the
# module of that name must count as imported already.
_sys.modules["smachpy.state"] = _sys.modules["smachpy.machines.state"]


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        from importlib import import_module

        return getattr(import_module(_LAZY[name]), name)
    home = "smachpy.viz" if name == "viz" else _SMACH_MODULES.get(f"smachpy.{name}")
    if home is not None:
        from importlib import import_module

        return import_module(home)
    raise AttributeError(f"module 'smachpy' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_LAZY})
