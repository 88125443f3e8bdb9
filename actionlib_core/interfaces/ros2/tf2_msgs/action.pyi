# Written by `actionlib interface stubs`; changes are lost.
from typing import TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.tf2_msgs.msg as _tf2_msgs_msg
from actionlib_core.interfaces import Ros2Action as _Ros2Action
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.time import Time as _Time
from actionlib_core.action._action_spec import HasFeedback as _HasFeedback
from actionlib_core.action._action_spec import HasGoal as _HasGoal
from actionlib_core.action._action_spec import HasResult as _HasResult

class LookupTransform(_Ros2Action):
    Goal: _TypeAlias = LookupTransform_Goal
    Result: _TypeAlias = LookupTransform_Result
    Feedback: _TypeAlias = LookupTransform_Feedback
    action_goal: _HasGoal[LookupTransform_Goal]
    action_result: _HasResult[LookupTransform_Result]
    action_feedback: _HasFeedback[LookupTransform_Feedback]

class LookupTransform_Goal(_Ros2Message):
    target_frame: str
    source_frame: str
    source_time: _builtin_interfaces_msg.Time
    timeout: _builtin_interfaces_msg.Duration
    target_time: _builtin_interfaces_msg.Time
    fixed_frame: str
    advanced: bool
    def __init__(
        self,
        target_frame: str | None = None,
        source_frame: str | None = None,
        source_time: _builtin_interfaces_msg.Time | _Time | float | None = None,
        timeout: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        target_time: _builtin_interfaces_msg.Time | _Time | float | None = None,
        fixed_frame: str | None = None,
        advanced: bool | None = None,
    ) -> None: ...

class LookupTransform_Result(_Ros2Message):
    transform: _geometry_msgs_msg.TransformStamped
    error: _tf2_msgs_msg.TF2Error
    def __init__(
        self,
        transform: _geometry_msgs_msg.TransformStamped | None = None,
        error: _tf2_msgs_msg.TF2Error | None = None,
    ) -> None: ...

class LookupTransform_Feedback(_Ros2Message):
    def __init__(self) -> None: ...
