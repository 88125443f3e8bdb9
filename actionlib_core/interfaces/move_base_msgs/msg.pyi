# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class MoveBaseAction(_Message):
    action_goal: MoveBaseActionGoal
    action_result: MoveBaseActionResult
    action_feedback: MoveBaseActionFeedback
    def __init__(
        self,
        action_goal: MoveBaseActionGoal | None = None,
        action_result: MoveBaseActionResult | None = None,
        action_feedback: MoveBaseActionFeedback | None = None,
    ) -> None: ...

class MoveBaseActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: MoveBaseGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: MoveBaseGoal | None = None,
    ) -> None: ...

class MoveBaseActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: MoveBaseResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: MoveBaseResult | None = None,
    ) -> None: ...

class MoveBaseActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: MoveBaseFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: MoveBaseFeedback | None = None,
    ) -> None: ...

class MoveBaseGoal(_Message):
    target_pose: _geometry_msgs_msg.PoseStamped  # Where to drive to; the frame of the header is that of the pose.
    def __init__(
        self,
        target_pose: _geometry_msgs_msg.PoseStamped | None = None,
    ) -> None: ...

class MoveBaseResult(_Message):
    def __init__(self) -> None: ...

class MoveBaseFeedback(_Message):
    base_position: _geometry_msgs_msg.PoseStamped  # Where the robot is.
    def __init__(
        self,
        base_position: _geometry_msgs_msg.PoseStamped | None = None,
    ) -> None: ...
