"""The states of a goal, with ROS's numbers.

Source:
    actionlib_msgs/GoalStatus and http://wiki.ros.org/actionlib/DetailedDescription.
"""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """The status that a server reports for a goal (actionlib_msgs/GoalStatus)."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9


class CommState(IntEnum):
    """The state of a goal as its client sees it."""

    WAITING_FOR_GOAL_ACK = 0
    PENDING = 1
    ACTIVE = 2
    WAITING_FOR_RESULT = 3
    WAITING_FOR_CANCEL_ACK = 4
    RECALLING = 5
    PREEMPTING = 6
    DONE = 7
    LOST = 8


class TerminalState(IntEnum):
    """How a goal ended; the numbers are those of `Status`."""

    RECALLED = Status.RECALLED
    REJECTED = Status.REJECTED
    PREEMPTED = Status.PREEMPTED
    ABORTED = Status.ABORTED
    SUCCEEDED = Status.SUCCEEDED
    LOST = Status.LOST


class SimpleGoalState(IntEnum):
    """The three states that `SimpleActionClient` shows."""

    PENDING = 0
    ACTIVE = 1
    DONE = 2


TERMINAL = frozenset(
    {Status.PREEMPTED, Status.SUCCEEDED, Status.ABORTED, Status.REJECTED, Status.RECALLED}
)
"""The final statuses of a server. LOST is not among them: only clients conclude it."""

OVER = frozenset({CommState.DONE, CommState.LOST})
"""The final states of a client."""

STARTED = frozenset({CommState.ACTIVE, CommState.PREEMPTING})
"""The states in which the server has accepted the goal and it has not ended."""
