"""What an action server keeps of one goal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core._core.server_goals import ServerGoal
from actionlib_core._core.states import Status
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core._action_wire import ActionTypes


class StatusTracker:
    """One goal of a server: the message that brought it and where it stands.

    Args:
        goal_id: The id of a goal of which only the id is known.
        status: With `goal_id`: the status number it begins with.
        goal: The XActionGoal message that arrived.

    Attributes:
        record: Its place in the life cycle.
        content: The XGoal message, None while only the id is known.
    """

    __slots__ = ("__weakref__", "_goal", "_types", "content", "record")

    def __init__(self, goal_id: Any = None, status: int | None = None, goal: Any = None) -> None:
        self._goal = goal
        self._types: ActionTypes | None = None
        self.content: Any = None if goal is None else goal.goal
        found = goal.goal_id if goal is not None else goal_id
        self.record = ServerGoal(
            "" if found is None else found.id,
            0 if found is None else found.stamp.to_nsec(),
            Status.PENDING if status is None else Status(status),
        )
        self.record.tag = self

    @classmethod
    def arrived(cls, record: ServerGoal, content: Any, types: ActionTypes) -> StatusTracker:
        """Make the tracker of a goal read from the network."""
        tracker = cls()
        tracker.bring(record, content, types)
        return tracker

    def bring(self, record: ServerGoal, content: Any, types: ActionTypes) -> None:
        """Fill in what was read from the network."""
        self.record, self.content, self._types = record, content, types
        record.tag = self

    @property
    def goal(self) -> Any:
        """The XActionGoal message, None while only the id is known."""
        if self._goal is None and self._types is not None:
            self._goal = self._types.action_goal(goal_id=self.goal_id, goal=self.content)
        return self._goal

    @property
    def goal_id(self) -> GoalID:
        """Id and stamp, as a message of its own."""
        return GoalID(stamp=Time(0, self.record.stamp_ns), id=self.record.id)

    @property
    def status(self) -> GoalStatus:
        """The status now, as a message of its own."""
        record = self.record
        return GoalStatus(goal_id=self.goal_id, status=int(record.status), text=record.text)
