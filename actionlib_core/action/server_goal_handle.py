"""`ServerGoalHandle`: what a server's program sees of one goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core.action.goal_keeper import GoalKeeper
    from actionlib_core.goal.server import ServerGoal


@dataclass(slots=True, weakref_slot=True, eq=False, repr=False)
class ServerGoalHandle:
    """One goal of an `ActionServer`. Two handles are equal when they belong to the same goal.

    ROS's attribute `status_tracker` is the handle itself, with a tracker's `goal`, `goal_id` and
    `status`.

    Attributes:
        keeper: The server's goals.
        record: The goal's status and result.
        content: The goal message (XGoal).
        begun: The goal callback has been called with it.
        cancel_waits: A cancel came before that.
        resumed: An earlier server, which was killed, had already accepted it.

    Threads: every method may be called from any thread and any callback.
    """

    keeper: GoalKeeper
    record: ServerGoal
    content: Any
    begun: bool = False
    cancel_waits: bool = False
    resumed: bool = False

    @property
    def goal(self) -> Any:
        """The XActionGoal message that brought the goal."""
        return self.keeper.types.action_goal(goal_id=self.goal_id, goal=self.content)

    @property
    def goal_id(self) -> GoalID:
        """Id and stamp, as a new message."""
        return GoalID(stamp=Time(0, self.record.stamp_ns), id=self.record.id)

    @property
    def status(self) -> GoalStatus:
        """The present status, as a new message."""
        record = self.record
        return GoalStatus(goal_id=self.goal_id, status=int(record.status), text=record.text)

    @property
    def status_tracker(self) -> ServerGoalHandle:
        """The handle itself."""
        return self

    def get_default_result(self) -> Any:
        """Return a new result message with default values."""
        return self.keeper.types.result()

    def set_accepted(self, text: str = "") -> None:
        """Accept the goal: PENDING becomes ACTIVE, RECALLING becomes PREEMPTING.

        Raises:
            IllegalTransitionError: the goal is in another state.
            ActionException: `text` is not a string.
        """
        self.keeper.step(self, "accept", "set_accepted()", text=text)

    def set_canceled(self, result: Any = None, text: str = "") -> None:
        """End a cancelled goal: RECALLED if it was never accepted, else PREEMPTED.

        Args:
            result: The result message; None sends one with default values.
            text: The reason, for people.

        Raises:
            IllegalTransitionError: the goal has ended.
            ActionException: `result` is not of the action's type, or `text` is not a string. The
                goal's status does not change.
        """
        self.keeper.step(self, "cancel", "set_canceled()", result, text)

    def set_rejected(self, result: Any = None, text: str = "") -> None:
        """Refuse a goal that is not accepted yet; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "reject", "set_rejected()", result, text)

    def set_aborted(self, result: Any = None, text: str = "") -> None:
        """End the goal in failure; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "abort", "set_aborted()", result, text)

    def set_succeeded(self, result: Any = None, text: str = "") -> None:
        """End the goal in success; arguments and errors as `set_canceled`."""
        self.keeper.step(self, "succeed", "set_succeeded()", result, text)

    def set_cancel_requested(self) -> bool:
        """Mark the goal as asked to stop; False when it has ended or was asked before."""
        return self.keeper.request_cancel(self)

    def publish_feedback(self, feedback: Any) -> None:
        """Send feedback to the goal's client.

        Raises:
            FieldError: `feedback` does not fit the action.
            TransportError: the server is stopped, or the session is closed.
        """
        self.keeper.send_feedback(self.record.entry(), feedback)

    def get_goal(self) -> Any:
        """Return the goal message (XGoal)."""
        return self.content

    def get_goal_id(self) -> GoalID:
        """Return the goal's id and stamp."""
        return self.goal_id

    def get_goal_status(self) -> GoalStatus:
        """Return a copy of the goal's status."""
        return self.status

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle):
            return NotImplemented
        return self.record.id == other.record.id

    def __hash__(self) -> int:
        return hash(self.record.id)

    def __repr__(self) -> str:
        return f"<ServerGoalHandle {self.record.id} {self.record.status.name}>"
