"""Classes of ROS 1's actionlib that this library does not need itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actionlib_core.goal.server import ServerGoal
from actionlib_core.goal.states import Status
from actionlib_core.interfaces.actionlib_msgs.msg import GoalID, GoalStatus
from actionlib_core.time import Time

if TYPE_CHECKING:
    from actionlib_core.action.server import ActionServer, ServerGoalHandle


class StatusTracker:
    """A ROS server's record of one goal. Servers here keep a `ServerGoalHandle`, which has the
    same attributes.

    Args:
        goal_id: The id (GoalID), for a goal of which nothing else is known.
        status: With `goal_id`: the goal's first status.
        goal: The XActionGoal message that arrived.

    Attributes:
        goal: See above.
        record: The goal's life cycle.
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
        """Id and stamp, as a new message."""
        return GoalID(stamp=Time(0, self.record.stamp_ns), id=self.record.id)

    @property
    def status(self) -> GoalStatus:
        """The status, as a new message."""
        record = self.record
        return GoalStatus(goal_id=self.goal_id, status=int(record.status), text=record.text)


class HandleTrackerDeleter:
    """Abandons a goal when it is called: after five seconds the server no longer lists it, and its
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
        """Abandon the goal. Also usable as the callback of a `weakref.ref`."""
        self.action_server.keeper.release(self.status_tracker.record)
