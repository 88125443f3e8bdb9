# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.unique_identifier_msgs.msg as _unique_identifier_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class GoalInfo(_Ros2Message):
    goal_id: _unique_identifier_msgs_msg.UUID
    stamp: _builtin_interfaces_msg.Time
    def __init__(
        self,
        goal_id: _unique_identifier_msgs_msg.UUID | None = None,
        stamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
    ) -> None: ...

class GoalStatus(_Ros2Message):
    STATUS_UNKNOWN: _Final = 0
    STATUS_ACCEPTED: _Final = 1
    STATUS_EXECUTING: _Final = 2
    STATUS_CANCELING: _Final = 3
    STATUS_SUCCEEDED: _Final = 4
    STATUS_CANCELED: _Final = 5
    STATUS_ABORTED: _Final = 6
    goal_info: GoalInfo
    status: int
    def __init__(
        self,
        goal_info: GoalInfo | None = None,
        status: int | None = None,
    ) -> None: ...

class GoalStatusArray(_Ros2Message):
    status_list: list[GoalStatus]
    def __init__(
        self,
        status_list: _Collection[GoalStatus] | None = None,
    ) -> None: ...
