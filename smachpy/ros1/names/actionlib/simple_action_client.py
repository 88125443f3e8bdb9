"""actionlib's client with one goal at a time."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.action.simple_client import SimpleActionClient as _SimpleActionClient
from actionlib_core.action.simple_client import SimpleGoalState as SimpleGoalState
from actionlib_core.interfaces.actionlib_msgs.msg import GoalStatus as GoalStatus
from smachpy.ros1.session import session
from smachpy.ros1.until_end import until_end

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.action.client_goal_handle import ClientGoalHandle


class SimpleActionClient(_SimpleActionClient[Any]):
    """Sends one goal at a time; in a dry program goals succeed at once and are not sent."""

    def __init__(self, ns: str, ActionSpec: Any) -> None:
        session().on_action(ns, getattr(ActionSpec, "_type", ""))
        super().__init__(ns, ActionSpec)
        self.ns = ns
        self._result_class = type(ActionSpec().action_result.result)

    def wait_for_server(self, timeout: Any = 0.0) -> bool:
        """Wait for a server; with 0, until the program is to end. That ends every wait."""
        session().check_time()
        return session().dry or until_end(
            f"a server of action {self.ns!r}", partial(super().wait_for_server, timeout), bool
        )

    def send_goal(
        self,
        goal: Any,
        done_cb: Callable[..., object] | None = None,
        active_cb: Callable[..., object] | None = None,
        feedback_cb: Callable[..., object] | None = None,
        **more: Any,
    ) -> None:
        """Send a goal and stop following the one before."""
        if not session().dry:
            super().send_goal(goal, done_cb, active_cb, feedback_cb, **more)

    def send_goal_and_wait(
        self, goal: Any, execute_timeout: Any = 0.0, preempt_timeout: Any = 0.0
    ) -> int:
        """Send a goal and wait for its end; return its status."""
        if session().dry:
            return int(GoalStatus.SUCCEEDED)
        return super().send_goal_and_wait(goal, execute_timeout, preempt_timeout)

    def wait_for_result(self, timeout: Any = 0.0) -> bool:
        """Wait for the end of the goal; with 0, until the program is to end."""
        session().check_time()
        return session().dry or super().wait_for_result(timeout)

    def _wait(self, handle: ClientGoalHandle, limit: float | None) -> bool:
        session().check_time()
        wait = partial(super()._wait, handle, limit)
        # Called inside a callback, it must not wait for the goal's callbacks, as those run in this
        # thread. `until_end` would wait in another thread, where this is not recognised.
        if handle.owner.callbacks.is_inside():
            return wait()
        return until_end(f"the result of action {self.ns!r}", wait, lambda: handle.goal.over)

    def get_result(self) -> Any:
        """Return the result of the goal."""
        return self._result_class() if session().dry else super().get_result()

    def get_state(self) -> int:
        """Return the status of the goal."""
        return int(GoalStatus.SUCCEEDED) if session().dry else super().get_state()
