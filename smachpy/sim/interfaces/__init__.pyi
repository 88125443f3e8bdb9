# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class ChargeAction(_Message):
    action_goal: ChargeActionGoal
    action_result: ChargeActionResult
    action_feedback: ChargeActionFeedback
    def __init__(
        self,
        action_goal: ChargeActionGoal | None = None,
        action_result: ChargeActionResult | None = None,
        action_feedback: ChargeActionFeedback | None = None,
    ) -> None: ...

class ChargeActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: ChargeGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: ChargeGoal | None = None,
    ) -> None: ...

class ChargeActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: ChargeResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: ChargeResult | None = None,
    ) -> None: ...

class ChargeActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: ChargeFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: ChargeFeedback | None = None,
    ) -> None: ...

class ChargeGoal(_Message):
    until: float  # Charge the battery at the dock. The robot must stand there already. charge to reach, 0 to 1
    def __init__(
        self,
        until: float | None = None,
    ) -> None: ...

class ChargeResult(_Message):
    charge: float  # charge when it ended, 0 to 1
    def __init__(
        self,
        charge: float | None = None,
    ) -> None: ...

class ChargeFeedback(_Message):
    charge: float  # now, 0 to 1
    seconds_left: float  # at the present power
    def __init__(
        self,
        charge: float | None = None,
        seconds_left: float | None = None,
    ) -> None: ...
