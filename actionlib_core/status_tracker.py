"""What an action server keeps of one goal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core._action_wire import StatusEntry
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
        found = goal.goal_id if goal is not None else goal_id
        record = ServerGoal(
            "" if found is None else found.id,
            0 if found is None else found.stamp.to_nsec(),
            Status.PENDING if status is None else Status(status),
        )
        self._fill(record, None if goal is None else goal.goal, goal, None)

    @classmethod
    def arrived(cls, record: ServerGoal, content: Any, types: ActionTypes) -> StatusTracker:
        """Make the tracker of a goal read from the network."""
        tracker = cls.__new__(cls)
        tracker._fill(record, content, None, types)  # noqa: SLF001  its own
        return tracker

    def _fill(self, record: ServerGoal, content: Any, goal: Any, types: ActionTypes | None) -> None:
        self.record = record
        self.content = content
        self._goal = goal
        self._types = types
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


def entry_of(goal: ServerGoal) -> StatusEntry:
    """Return what the status list says of a goal."""
    return StatusEntry(goal.id, goal.stamp_ns, goal.status, goal.text)


def entry_of_status(status: GoalStatus) -> StatusEntry:
    """Return what a status message says."""
    goal_id = status.goal_id
    return StatusEntry(goal_id.id, goal_id.stamp.to_nsec(), status.status, status.text)


def text_of_past(status: Status) -> str:
    """Return the text for a goal of which only its end is remembered."""
    if status is Status.LOST:
        return "The action server does not know this goal"
    return f"The goal ended {status.name}; its result is no longer kept"
