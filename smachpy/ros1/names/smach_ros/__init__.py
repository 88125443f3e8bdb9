"""smach_ros's public names. As in ROS 1, importing it sends SMACH's log to rospy."""

from smachpy.actions.action_server_wrapper import ActionServerWrapper as _ActionServerWrapper
from smachpy.actions.condition_state import ConditionState
from smachpy.actions.monitor_state import MonitorState
from smachpy.actions.service_state import ServiceState
from smachpy.actions.simple_action_state import SimpleActionState
from smachpy.base.log import set_loggers
from smachpy.machines.preempt_handler import set_preempt_handler
from smachpy.network.client import IntrospectionClient
from smachpy.network.server import IntrospectionServer
from smachpy.ros1.names.rospy import core as _core
from smachpy.ros1.session import session

__all__ = [
    "ActionServerWrapper",
    "ConditionState",
    "IntrospectionClient",
    "IntrospectionServer",
    "MonitorState",
    "ServiceState",
    "SimpleActionState",
    "set_preempt_handler",
]


class ActionServerWrapper(_ActionServerWrapper):
    """Runs a container for each goal of an action."""

    def run_server(self) -> None:
        """Begin to serve; a dry program ends here."""
        session().stop(self.wrapped_container)
        super().run_server()


def _send_log_to_rospy() -> None:
    if not session().shows_transitions:
        set_loggers(_core.loginfo, _core.logwarn, _core.logdebug, _core.logerr)


_send_log_to_rospy()
