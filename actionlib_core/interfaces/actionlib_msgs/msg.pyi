# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Time as _Time

class GoalID(_Message):
    stamp: _Time
    id: str
    def __init__(
        self,
        stamp: _Time | float | None = None,
        id: str | None = None,
    ) -> None: ...

class GoalStatus(_Message):
    PENDING: _Final = 0
    ACTIVE: _Final = 1
    PREEMPTED: _Final = 2
    SUCCEEDED: _Final = 3
    ABORTED: _Final = 4
    REJECTED: _Final = 5
    PREEMPTING: _Final = 6
    RECALLING: _Final = 7
    RECALLED: _Final = 8
    LOST: _Final = 9
    goal_id: GoalID
    status: int
    text: str
    def __init__(
        self,
        goal_id: GoalID | None = None,
        status: int | None = None,
        text: str | None = None,
    ) -> None: ...

class GoalStatusArray(_Message):
    header: _std_msgs_msg.Header
    status_list: list[GoalStatus]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status_list: _Collection[GoalStatus] | None = None,
    ) -> None: ...
