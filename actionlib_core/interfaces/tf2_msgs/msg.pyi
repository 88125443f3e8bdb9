# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.time import Time as _Time

class TF2Error(_Message):
    NO_ERROR: _Final = 0  # Values of `error`.
    LOOKUP_ERROR: _Final = 1
    CONNECTIVITY_ERROR: _Final = 2
    EXTRAPOLATION_ERROR: _Final = 3
    INVALID_ARGUMENT_ERROR: _Final = 4
    TIMEOUT_ERROR: _Final = 5
    TRANSFORM_ERROR: _Final = 6
    error: int
    error_string: str
    def __init__(
        self,
        error: int | None = None,
        error_string: str | None = None,
    ) -> None: ...

class TFMessage(_Message):
    """Poses of frames in each other."""

    transforms: list[_geometry_msgs_msg.TransformStamped]
    def __init__(
        self,
        transforms: _Collection[_geometry_msgs_msg.TransformStamped] | None = None,
    ) -> None: ...

class LookupTransformAction(_Message):
    action_goal: LookupTransformActionGoal
    action_result: LookupTransformActionResult
    action_feedback: LookupTransformActionFeedback
    def __init__(
        self,
        action_goal: LookupTransformActionGoal | None = None,
        action_result: LookupTransformActionResult | None = None,
        action_feedback: LookupTransformActionFeedback | None = None,
    ) -> None: ...

class LookupTransformActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: LookupTransformGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: LookupTransformGoal | None = None,
    ) -> None: ...

class LookupTransformActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: LookupTransformResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: LookupTransformResult | None = None,
    ) -> None: ...

class LookupTransformActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: LookupTransformFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: LookupTransformFeedback | None = None,
    ) -> None: ...

class LookupTransformGoal(_Message):
    target_frame: str  # Simple form: the newest or the one at a time.
    source_frame: str
    source_time: _Time
    timeout: _Duration
    target_time: _Time  # Advanced form, across time, through a frame that does not move.
    fixed_frame: str
    advanced: bool  # which of the two forms
    def __init__(
        self,
        target_frame: str | None = None,
        source_frame: str | None = None,
        source_time: _Time | float | None = None,
        timeout: _Duration | float | None = None,
        target_time: _Time | float | None = None,
        fixed_frame: str | None = None,
        advanced: bool | None = None,
    ) -> None: ...

class LookupTransformResult(_Message):
    transform: _geometry_msgs_msg.TransformStamped
    error: TF2Error
    def __init__(
        self,
        transform: _geometry_msgs_msg.TransformStamped | None = None,
        error: TF2Error | None = None,
    ) -> None: ...

class LookupTransformFeedback(_Message):
    def __init__(self) -> None: ...
