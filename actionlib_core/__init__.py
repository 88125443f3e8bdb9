"""Actions, services, topics, messages and time over Zenoh, without ROS.

`import actionlib_core as actionlib` runs programs written for ROS 1's actionlib. Everything here is
imported on first use, so importing the package itself takes very little time.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from actionlib_core import compat as _compat

if TYPE_CHECKING:
    from actionlib_core.action.client import ActionClient as ActionClient
    from actionlib_core.action.client import ClientGoalHandle as ClientGoalHandle
    from actionlib_core.action.client import CommState as CommState
    from actionlib_core.action.client import CommStateMachine as CommStateMachine
    from actionlib_core.action.client import GoalManager as GoalManager
    from actionlib_core.action.client import TerminalState as TerminalState
    from actionlib_core.action.client import get_name_of_constant as get_name_of_constant
    from actionlib_core.action.compat import HandleTrackerDeleter as HandleTrackerDeleter
    from actionlib_core.action.compat import StatusTracker as StatusTracker
    from actionlib_core.action.decorated import Abort as Abort
    from actionlib_core.action.decorated import GoalContext as GoalContext
    from actionlib_core.action.decorated import Preempted as Preempted
    from actionlib_core.action.decorated import Reject as Reject
    from actionlib_core.action.decorated import server as server
    from actionlib_core.action.goal_id_generator import GoalIDGenerator as GoalIDGenerator
    from actionlib_core.action.sent_goal import SentGoal as SentGoal
    from actionlib_core.action.server import ActionServer as ActionServer
    from actionlib_core.action.server import ServerGoalHandle as ServerGoalHandle
    from actionlib_core.action.server import nop_cb as nop_cb
    from actionlib_core.action.simple_client import SimpleActionClient as SimpleActionClient
    from actionlib_core.action.simple_client import SimpleGoalState as SimpleGoalState
    from actionlib_core.action.simple_server import SimpleActionServer as SimpleActionServer
    from actionlib_core.exceptions import ActionException as ActionException
    from actionlib_core.exceptions import ActionlibError as ActionlibError
    from actionlib_core.exceptions import GoalFailedError as GoalFailedError
    from actionlib_core.exceptions import GoalTimeoutError as GoalTimeoutError
    from actionlib_core.exceptions import RemoteNodeError as RemoteNodeError
    from actionlib_core.exceptions import ServiceException as ServiceException
    from actionlib_core.node import Node as Node
    from actionlib_core.node import get_node as get_node
    from actionlib_core.node import init as init
    from actionlib_core.node import use_node as use_node
    from actionlib_core.pubsub.remote_node import RemoteNode as RemoteNode
    from actionlib_core.pubsub.service import Service as Service
    from actionlib_core.pubsub.service_proxy import ServiceProxy as ServiceProxy
    from actionlib_core.pubsub.service_proxy import wait_for_service as wait_for_service
    from actionlib_core.pubsub.topic import Publisher as Publisher
    from actionlib_core.pubsub.topic import Subscriber as Subscriber
    from actionlib_core.pubsub.topic import wait_for_message as wait_for_message
    from actionlib_core.time import Duration as Duration
    from actionlib_core.time import Time as Time

# Module -> the names that are imported from it.
_NAMES = {
    "action.client": (
        "ActionClient",
        "ClientGoalHandle",
        "CommState",
        "CommStateMachine",
        "GoalManager",
        "TerminalState",
        "get_name_of_constant",
    ),
    "action.server": ("ActionServer", "ServerGoalHandle", "nop_cb"),
    "exceptions": (
        "ActionException",
        "ActionlibError",
        "GoalFailedError",
        "GoalTimeoutError",
        "RemoteNodeError",
        "ServiceException",
    ),
    "action.goal_id_generator": ("GoalIDGenerator",),
    "action.decorated": ("Abort", "GoalContext", "Preempted", "Reject", "server"),
    "action.compat": ("HandleTrackerDeleter", "StatusTracker"),
    "node": ("Node", "get_node", "init", "use_node"),
    "action.sent_goal": ("SentGoal",),
    "pubsub.remote_node": ("RemoteNode",),
    "pubsub.service": ("Service",),
    "pubsub.service_proxy": ("ServiceProxy", "wait_for_service"),
    "action.simple_client": ("SimpleActionClient", "SimpleGoalState"),
    "action.simple_server": ("SimpleActionServer",),
    "time": ("Duration", "Time"),
    "pubsub.topic": ("Publisher", "Subscriber", "wait_for_message"),
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}

_compat.alias_modules(_compat.MODULES)

__all__ = sorted(_MODULE_OF)  # noqa: PLE0605  one list for both purposes


def __getattr__(name: str) -> Any:
    module = _MODULE_OF.get(name)
    if module is not None:
        value = getattr(importlib.import_module(f"{__name__}.{module}"), name)
        globals()[name] = value
        return value
    if name in _NAMES or f"{__name__}.{name}" in _compat.MODULES:  # modules, as in ROS 1
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_NAMES})
