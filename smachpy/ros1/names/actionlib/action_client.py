"""actionlib's client with a handle for each goal."""

from __future__ import annotations

from functools import partial
from typing import Any

from actionlib_core.action.client import ActionClient as _ActionClient
from actionlib_core.action.client import ClientGoalHandle as ClientGoalHandle
from actionlib_core.action.client import CommState as CommState
from actionlib_core.action.client import CommStateMachine as CommStateMachine
from actionlib_core.action.client import GoalManager as GoalManager
from actionlib_core.action.client import TerminalState as TerminalState
from actionlib_core.action.client import get_name_of_constant as get_name_of_constant
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus as GoalStatus
from smachpy.ros1.session import session
from smachpy.ros1.until_end import until_end


class ActionClient(_ActionClient[Any]):
    """Sends goals and returns a handle for each."""

    def __init__(self, ns: str, ActionSpec: Any) -> None:
        session().on_action(ns, getattr(ActionSpec, "_type", ""))
        super().__init__(ns, ActionSpec)
        self.ns = ns

    def wait_for_server(self, timeout: Any = 0.0) -> bool:
        """Wait for a server until the program is to end; a dry program gets True at once."""
        return session().dry or until_end(
            f"a server of action {self.ns!r}", partial(super().wait_for_server, timeout), bool
        )

    wait_for_action_server_to_start = wait_for_server
