"""What a server's code holds for one goal: the methods that move it along its life cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from actionlib_core.action_server import ActionServer
    from actionlib_core.handle_tracker_deleter import HandleTrackerDeleter
    from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
    from actionlib_core.status_tracker import StatusTracker


class ServerGoalHandle:
    """One goal of an `ActionServer`. Two handles are equal when they are of one goal.

    Args:
        status_tracker: What the server keeps of the goal.
        action_server: The server.
        handle_tracker: Accepted as in ROS 1; not needed here.

    Threads: every method may be called from any thread and any callback.
    """

    __slots__ = ("__weakref__", "action_server", "handle_tracker", "status_tracker")

    def __init__(
        self,
        status_tracker: StatusTracker,
        action_server: ActionServer,
        handle_tracker: HandleTrackerDeleter | None = None,
    ) -> None:
        self.status_tracker = status_tracker
        self.action_server = action_server
        self.handle_tracker = handle_tracker

    @property
    def goal(self) -> Any:
        """The XActionGoal message that brought the goal."""
        return self.status_tracker.goal

    def get_default_result(self) -> Any:
        """Return a new result message with default values."""
        return self.action_server.ActionResultType()

    def set_accepted(self, text: str = "") -> None:
        """Accept the goal: PENDING becomes ACTIVE, RECALLING becomes PREEMPTING.

        Raises:
            IllegalTransitionError: the goal is in another state.
            ActionException: `text` is not a string.
        """
        self.action_server.accept(self.status_tracker, text)

    def set_canceled(self, result: Any = None, text: str = "") -> None:
        """End the goal as asked: RECALLED when it was never accepted, else PREEMPTED.

        Args:
            result: The result message; None sends one with default values.
            text: Why, for people.

        Raises:
            IllegalTransitionError: the goal has ended.
            ActionException: `result` is not of the action's type, or `text` is not a string; the
                goal goes on.
        """
        self.action_server.finish(self.status_tracker, "cancel", "set_canceled()", result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """Refuse the goal; arguments and errors as `set_canceled`, allowed before acceptance."""
        self.action_server.finish(self.status_tracker, "reject", "set_rejected()", result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal in failure; arguments and errors as `set_canceled`."""
        self.action_server.finish(self.status_tracker, "abort", "set_aborted()", result, text)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal in success; arguments and errors as `set_canceled`."""
        self.action_server.finish(self.status_tracker, "succeed", "set_succeeded()", result, text)

    def set_cancel_requested(self) -> bool:
        """Note that the goal is asked to stop; False when it has ended or was asked before."""
        return self.action_server.request_cancel(self.status_tracker)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the goal's client.

        Raises:
            FieldError: `feedback` does not fit the action.
            TransportError: the server's node is closed.
        """
        self.action_server.publish_feedback(self.get_goal_status(), feedback)

    def get_goal(self) -> Any:
        """Return the goal message (XGoal)."""
        return self.status_tracker.content

    def get_goal_id(self) -> GoalID:
        """Return the goal's id and stamp."""
        return self.status_tracker.goal_id

    def get_goal_status(self) -> GoalStatus:
        """Return a copy of the goal's status."""
        return self.status_tracker.status

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle):
            return NotImplemented
        return self.status_tracker.record.id == other.status_tracker.record.id

    def __hash__(self) -> int:
        return hash(self.status_tracker.record.id)

    def __repr__(self) -> str:
        record = self.status_tracker.record
        return f"<ServerGoalHandle {record.id} {record.status.name}>"
