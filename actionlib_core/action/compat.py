"""Names of ROS 1's actionlib for what has another shape here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.goal.server import ServerGoal
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core.action.server import ActionServer, ServerGoalHandle


class StatusTracker:
    """What ROS's server keeps of one goal. Servers here keep a `ServerGoalHandle`, which has the
    same attributes.

    Args:
        goal_id: The id (GoalID) of a goal of which only the id is known.
        status: With `goal_id`: the status number it begins with.
        goal: The XActionGoal message that arrived.

    Attributes:
        goal: See above.
        record: Its place in the life cycle.
    """  # noqa: D205  one sentence

    def __init__(self, goal_id: Any = None, status: int | None = None, goal: Any = None) -> None:
        self.goal = goal
        found = goal.goal_id if goal is not None else goal_id
        self.record = ServerGoal(
            "" if found is None else found.id,
            0 if found is None else found.stamp.to_nsec(),
            Status.PENDING if status is None else Status(status),
        )

    @property
    def goal_id(self) -> GoalID:
        """Id and stamp, as a message of its own."""
        return GoalID(stamp=Time(0, self.record.stamp_ns), id=self.record.id)

    @property
    def status(self) -> GoalStatus:
        """The status, as a message of its own."""
        record = self.record
        return GoalStatus(goal_id=self.goal_id, status=int(record.status), text=record.text)


class HandleTrackerDeleter:
    """Gives a goal up when it is called: after five seconds the server lists it no more, and its
    client learns that it is LOST.

    Args:
        action_server: The server that has the goal.
        status_tracker: The goal.
    """  # noqa: D205  one sentence

    def __init__(
        self, action_server: ActionServer, status_tracker: ServerGoalHandle | StatusTracker
    ) -> None:
        self.action_server = action_server
        self.status_tracker = status_tracker

    def __call__(self, _reference: object = None) -> None:
        """Give the goal up. Also usable as the callback of a `weakref.ref`."""
        self.action_server.keeper.release(self.status_tracker.record)
