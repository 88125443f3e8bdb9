# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
import actionlib_core.interfaces.trajectory_msgs.msg as _trajectory_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration

class GripperCommand(_Message):
    position: float  # [m]
    max_effort: float  # [N]; 0: no limit
    def __init__(
        self,
        position: float | None = None,
        max_effort: float | None = None,
    ) -> None: ...

class JointTolerance(_Message):
    name: str  # How far a joint may be from its trajectory. 0: not said, negative: any.
    position: float  # [rad] or [m]
    velocity: float  # [rad/s] or [m/s]
    acceleration: float  # [rad/s^2] or [m/s^2]
    def __init__(
        self,
        name: str | None = None,
        position: float | None = None,
        velocity: float | None = None,
        acceleration: float | None = None,
    ) -> None: ...

class FollowJointTrajectoryAction(_Message):
    action_goal: FollowJointTrajectoryActionGoal
    action_result: FollowJointTrajectoryActionResult
    action_feedback: FollowJointTrajectoryActionFeedback
    def __init__(
        self,
        action_goal: FollowJointTrajectoryActionGoal | None = None,
        action_result: FollowJointTrajectoryActionResult | None = None,
        action_feedback: FollowJointTrajectoryActionFeedback | None = None,
    ) -> None: ...

class FollowJointTrajectoryActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: FollowJointTrajectoryGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: FollowJointTrajectoryGoal | None = None,
    ) -> None: ...

class FollowJointTrajectoryActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: FollowJointTrajectoryResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: FollowJointTrajectoryResult | None = None,
    ) -> None: ...

class FollowJointTrajectoryActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: FollowJointTrajectoryFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: FollowJointTrajectoryFeedback | None = None,
    ) -> None: ...

class FollowJointTrajectoryGoal(_Message):
    trajectory: _trajectory_msgs_msg.JointTrajectory
    path_tolerance: list[JointTolerance]  # during the motion
    goal_tolerance: list[JointTolerance]  # at its end
    goal_time_tolerance: _Duration  # how late the end may be
    def __init__(
        self,
        trajectory: _trajectory_msgs_msg.JointTrajectory | None = None,
        path_tolerance: _Collection[JointTolerance] | None = None,
        goal_tolerance: _Collection[JointTolerance] | None = None,
        goal_time_tolerance: _Duration | float | None = None,
    ) -> None: ...

class FollowJointTrajectoryResult(_Message):
    SUCCESSFUL: _Final = 0
    INVALID_GOAL: _Final = -1
    INVALID_JOINTS: _Final = -2
    OLD_HEADER_TIMESTAMP: _Final = -3
    PATH_TOLERANCE_VIOLATED: _Final = -4
    GOAL_TOLERANCE_VIOLATED: _Final = -5
    error_code: int  # one of these
    error_string: str
    def __init__(
        self,
        error_code: int | None = None,
        error_string: str | None = None,
    ) -> None: ...

class FollowJointTrajectoryFeedback(_Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    desired: _trajectory_msgs_msg.JointTrajectoryPoint
    actual: _trajectory_msgs_msg.JointTrajectoryPoint
    error: _trajectory_msgs_msg.JointTrajectoryPoint
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        desired: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        actual: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        error: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
    ) -> None: ...

class GripperCommandAction(_Message):
    action_goal: GripperCommandActionGoal
    action_result: GripperCommandActionResult
    action_feedback: GripperCommandActionFeedback
    def __init__(
        self,
        action_goal: GripperCommandActionGoal | None = None,
        action_result: GripperCommandActionResult | None = None,
        action_feedback: GripperCommandActionFeedback | None = None,
    ) -> None: ...

class GripperCommandActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: GripperCommandGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: GripperCommandGoal | None = None,
    ) -> None: ...

class GripperCommandActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: GripperCommandResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: GripperCommandResult | None = None,
    ) -> None: ...

class GripperCommandActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: GripperCommandFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: GripperCommandFeedback | None = None,
    ) -> None: ...

class GripperCommandGoal(_Message):
    command: GripperCommand
    def __init__(
        self,
        command: GripperCommand | None = None,
    ) -> None: ...

class GripperCommandResult(_Message):
    position: float  # the gap [m]
    effort: float  # [N]
    stalled: bool  # pressing and not moving
    reached_goal: bool
    def __init__(
        self,
        position: float | None = None,
        effort: float | None = None,
        stalled: bool | None = None,
        reached_goal: bool | None = None,
    ) -> None: ...

class GripperCommandFeedback(_Message):
    position: float  # the gap [m]
    effort: float  # [N]
    stalled: bool  # pressing and not moving
    reached_goal: bool
    def __init__(
        self,
        position: float | None = None,
        effort: float | None = None,
        stalled: bool | None = None,
        reached_goal: bool | None = None,
    ) -> None: ...

class PointHeadAction(_Message):
    action_goal: PointHeadActionGoal
    action_result: PointHeadActionResult
    action_feedback: PointHeadActionFeedback
    def __init__(
        self,
        action_goal: PointHeadActionGoal | None = None,
        action_result: PointHeadActionResult | None = None,
        action_feedback: PointHeadActionFeedback | None = None,
    ) -> None: ...

class PointHeadActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: PointHeadGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: PointHeadGoal | None = None,
    ) -> None: ...

class PointHeadActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: PointHeadResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: PointHeadResult | None = None,
    ) -> None: ...

class PointHeadActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: PointHeadFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: PointHeadFeedback | None = None,
    ) -> None: ...

class PointHeadGoal(_Message):
    target: _geometry_msgs_msg.PointStamped
    pointing_axis: _geometry_msgs_msg.Vector3
    pointing_frame: str
    min_duration: _Duration
    max_velocity: float
    def __init__(
        self,
        target: _geometry_msgs_msg.PointStamped | None = None,
        pointing_axis: _geometry_msgs_msg.Vector3 | None = None,
        pointing_frame: str | None = None,
        min_duration: _Duration | float | None = None,
        max_velocity: float | None = None,
    ) -> None: ...

class PointHeadResult(_Message):
    def __init__(self) -> None: ...

class PointHeadFeedback(_Message):
    pointing_angle_error: float
    def __init__(
        self,
        pointing_angle_error: float | None = None,
    ) -> None: ...

class SingleJointPositionAction(_Message):
    action_goal: SingleJointPositionActionGoal
    action_result: SingleJointPositionActionResult
    action_feedback: SingleJointPositionActionFeedback
    def __init__(
        self,
        action_goal: SingleJointPositionActionGoal | None = None,
        action_result: SingleJointPositionActionResult | None = None,
        action_feedback: SingleJointPositionActionFeedback | None = None,
    ) -> None: ...

class SingleJointPositionActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: SingleJointPositionGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: SingleJointPositionGoal | None = None,
    ) -> None: ...

class SingleJointPositionActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: SingleJointPositionResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: SingleJointPositionResult | None = None,
    ) -> None: ...

class SingleJointPositionActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: SingleJointPositionFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: SingleJointPositionFeedback | None = None,
    ) -> None: ...

class SingleJointPositionGoal(_Message):
    position: float
    min_duration: _Duration
    max_velocity: float
    def __init__(
        self,
        position: float | None = None,
        min_duration: _Duration | float | None = None,
        max_velocity: float | None = None,
    ) -> None: ...

class SingleJointPositionResult(_Message):
    def __init__(self) -> None: ...

class SingleJointPositionFeedback(_Message):
    header: _std_msgs_msg.Header
    position: float
    velocity: float
    error: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        position: float | None = None,
        velocity: float | None = None,
        error: float | None = None,
    ) -> None: ...
