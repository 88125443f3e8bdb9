# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Time as _Time

class GoalID(_Message):
    """Names one goal. In a cancel request an empty id with stamp 0 means all goals, with another stamp all goals up to then."""

    stamp: _Time  # when the goal was sent
    id: str  # unique, for example /patrol-3-1700000000.250
    def __init__(
        self,
        stamp: _Time | float | None = None,
        id: str | None = None,
    ) -> None: ...

class GoalStatus(_Message):
    """What has become of one goal."""

    PENDING: _Final = 0  # received, not yet looked at
    ACTIVE: _Final = 1  # being worked on
    PREEMPTED: _Final = 2  # cancelled after it was active (final)
    SUCCEEDED: _Final = 3  # reached (final)
    ABORTED: _Final = 4  # given up by the server (final)
    REJECTED: _Final = 5  # refused unprocessed (final)
    PREEMPTING: _Final = 6  # cancel asked for while active, not yet done
    RECALLING: _Final = 7  # cancel asked for while pending, not yet done
    RECALLED: _Final = 8  # cancelled before it was active (final)
    LOST: _Final = 9  # no news of it; only clients say so, servers never send it
    goal_id: GoalID
    status: int  # one of the constants
    text: str  # why, for people to read
    def __init__(
        self,
        goal_id: GoalID | None = None,
        status: int | None = None,
        text: str | None = None,
    ) -> None: ...

class GoalStatusArray(_Message):
    """All goals that an action server keeps track of."""

    header: _std_msgs_msg.Header
    status_list: list[GoalStatus]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status_list: _Collection[GoalStatus] | None = None,
    ) -> None: ...
