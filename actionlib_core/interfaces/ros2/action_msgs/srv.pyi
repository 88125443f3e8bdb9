# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.action_msgs.msg as _action_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class CancelGoal(_Ros2Service):
    Request: _TypeAlias = CancelGoal_Request
    Response: _TypeAlias = CancelGoal_Response
    _request_class: _ClassVar[type[CancelGoal_Request]]
    _response_class: _ClassVar[type[CancelGoal_Response]]

class CancelGoal_Request(_Ros2Message):
    goal_info: _action_msgs_msg.GoalInfo
    def __init__(
        self,
        goal_info: _action_msgs_msg.GoalInfo | None = None,
    ) -> None: ...

class CancelGoal_Response(_Ros2Message):
    ERROR_NONE: _Final = 0
    ERROR_REJECTED: _Final = 1
    ERROR_UNKNOWN_GOAL_ID: _Final = 2
    ERROR_GOAL_TERMINATED: _Final = 3
    return_code: int
    goals_canceling: list[_action_msgs_msg.GoalInfo]
    def __init__(
        self,
        return_code: int | None = None,
        goals_canceling: _Collection[_action_msgs_msg.GoalInfo] | None = None,
    ) -> None: ...
