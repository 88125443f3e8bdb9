# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class DemoMsg(_Message):
    greeting: str  # A greeting with a number, ten times a second.
    number: int
    def __init__(
        self,
        greeting: str | None = None,
        number: int | None = None,
    ) -> None: ...

class CountdownAction(_Message):
    action_goal: CountdownActionGoal
    action_result: CountdownActionResult
    action_feedback: CountdownActionFeedback
    def __init__(
        self,
        action_goal: CountdownActionGoal | None = None,
        action_result: CountdownActionResult | None = None,
        action_feedback: CountdownActionFeedback | None = None,
    ) -> None: ...

class CountdownActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: CountdownGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: CountdownGoal | None = None,
    ) -> None: ...

class CountdownActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: CountdownResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: CountdownResult | None = None,
    ) -> None: ...

class CountdownActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: CountdownFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: CountdownFeedback | None = None,
    ) -> None: ...

class CountdownGoal(_Message):
    seconds: int  # Count down to zero, one step a second. where to begin
    def __init__(
        self,
        seconds: int | None = None,
    ) -> None: ...

class CountdownResult(_Message):
    seconds_left: int  # 0 unless it was stopped
    def __init__(
        self,
        seconds_left: int | None = None,
    ) -> None: ...

class CountdownFeedback(_Message):
    seconds_left: int
    def __init__(
        self,
        seconds_left: int | None = None,
    ) -> None: ...

class DeliverAction(_Message):
    action_goal: DeliverActionGoal
    action_result: DeliverActionResult
    action_feedback: DeliverActionFeedback
    def __init__(
        self,
        action_goal: DeliverActionGoal | None = None,
        action_result: DeliverActionResult | None = None,
        action_feedback: DeliverActionFeedback | None = None,
    ) -> None: ...

class DeliverActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: DeliverGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: DeliverGoal | None = None,
    ) -> None: ...

class DeliverActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: DeliverResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: DeliverResult | None = None,
    ) -> None: ...

class DeliverActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: DeliverFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: DeliverFeedback | None = None,
    ) -> None: ...

class DeliverGoal(_Message):
    order: str  # Fetch a parcel at one place and hand it over at another. Poses are in the frame map. which one
    attempt: int  # how often it was handed out, this time included
    pickup: _geometry_msgs_msg.Pose
    dropoff: _geometry_msgs_msg.Pose
    def __init__(
        self,
        order: str | None = None,
        attempt: int | None = None,
        pickup: _geometry_msgs_msg.Pose | None = None,
        dropoff: _geometry_msgs_msg.Pose | None = None,
    ) -> None: ...

class DeliverResult(_Message):
    aboard: bool  # whether the parcel is on the robot now
    charge: float  # of its battery, 0 to 1; 0: not known
    text: str  # what it was doing when it ended
    def __init__(
        self,
        aboard: bool | None = None,
        charge: float | None = None,
        text: str | None = None,
    ) -> None: ...

class DeliverFeedback(_Message):
    doing: str  # in words
    base_position: _geometry_msgs_msg.PoseStamped  # where the robot is
    def __init__(
        self,
        doing: str | None = None,
        base_position: _geometry_msgs_msg.PoseStamped | None = None,
    ) -> None: ...

class Demo_actionAction(_Message):
    action_goal: Demo_actionActionGoal
    action_result: Demo_actionActionResult
    action_feedback: Demo_actionActionFeedback
    def __init__(
        self,
        action_goal: Demo_actionActionGoal | None = None,
        action_result: Demo_actionActionResult | None = None,
        action_feedback: Demo_actionActionFeedback | None = None,
    ) -> None: ...

class Demo_actionActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: Demo_actionGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: Demo_actionGoal | None = None,
    ) -> None: ...

class Demo_actionActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: Demo_actionResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: Demo_actionResult | None = None,
    ) -> None: ...

class Demo_actionActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: Demo_actionFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: Demo_actionFeedback | None = None,
    ) -> None: ...

class Demo_actionGoal(_Message):
    count: int  # Count from 1 to a number, one step a second. where to stop, 0 or more
    def __init__(
        self,
        count: int | None = None,
    ) -> None: ...

class Demo_actionResult(_Message):
    final_count: int  # the last number counted
    def __init__(
        self,
        final_count: int | None = None,
    ) -> None: ...

class Demo_actionFeedback(_Message):
    current_number: int  # the number counted just now
    def __init__(
        self,
        current_number: int | None = None,
    ) -> None: ...

class RechargeAction(_Message):
    action_goal: RechargeActionGoal
    action_result: RechargeActionResult
    action_feedback: RechargeActionFeedback
    def __init__(
        self,
        action_goal: RechargeActionGoal | None = None,
        action_result: RechargeActionResult | None = None,
        action_feedback: RechargeActionFeedback | None = None,
    ) -> None: ...

class RechargeActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: RechargeGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: RechargeGoal | None = None,
    ) -> None: ...

class RechargeActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: RechargeResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: RechargeResult | None = None,
    ) -> None: ...

class RechargeActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: RechargeFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: RechargeFeedback | None = None,
    ) -> None: ...

class RechargeGoal(_Message):
    dock: _geometry_msgs_msg.Pose  # Drive to a dock, charge there, and leave it again. Poses are in the frame map.
    outside: _geometry_msgs_msg.Pose  # where to stand afterwards, so that the dock is free
    until: float  # charge to reach, 0 to 1
    def __init__(
        self,
        dock: _geometry_msgs_msg.Pose | None = None,
        outside: _geometry_msgs_msg.Pose | None = None,
        until: float | None = None,
    ) -> None: ...

class RechargeResult(_Message):
    left: bool  # whether the robot has left the dock
    charge: float  # of its battery, 0 to 1; 0: not known
    text: str  # what it was doing when it ended
    def __init__(
        self,
        left: bool | None = None,
        charge: float | None = None,
        text: str | None = None,
    ) -> None: ...

class RechargeFeedback(_Message):
    doing: str  # in words
    base_position: _geometry_msgs_msg.PoseStamped  # where the robot is
    def __init__(
        self,
        doing: str | None = None,
        base_position: _geometry_msgs_msg.PoseStamped | None = None,
    ) -> None: ...

class TurnAction(_Message):
    action_goal: TurnActionGoal
    action_result: TurnActionResult
    action_feedback: TurnActionFeedback
    def __init__(
        self,
        action_goal: TurnActionGoal | None = None,
        action_result: TurnActionResult | None = None,
        action_feedback: TurnActionFeedback | None = None,
    ) -> None: ...

class TurnActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: TurnGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: TurnGoal | None = None,
    ) -> None: ...

class TurnActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: TurnResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: TurnResult | None = None,
    ) -> None: ...

class TurnActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: TurnFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: TurnFeedback | None = None,
    ) -> None: ...

class TurnGoal(_Message):
    target_angle: float  # Turn on the spot. [deg], anticlockwise
    absolute_relative_flag: str  # ABS: to this heading, the shortest way; REL: by this angle from here
    max_ang_vel: float  # [deg/s], above 0; 0: as fast as the server allows
    def __init__(
        self,
        target_angle: float | None = None,
        absolute_relative_flag: str | None = None,
        max_ang_vel: float | None = None,
    ) -> None: ...

class TurnResult(_Message):
    result: str  # how it ended, in words
    turned: float  # [deg], anticlockwise
    def __init__(
        self,
        result: str | None = None,
        turned: float | None = None,
    ) -> None: ...

class TurnFeedback(_Message):
    feedback: str  # how it goes, in words
    left: float  # [deg] still to turn
    def __init__(
        self,
        feedback: str | None = None,
        left: float | None = None,
    ) -> None: ...
