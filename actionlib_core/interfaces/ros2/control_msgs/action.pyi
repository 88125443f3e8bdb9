# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.control_msgs.msg as _control_msgs_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
import actionlib_core.interfaces.ros2.trajectory_msgs.msg as _trajectory_msgs_msg
from actionlib_core.interfaces import Ros2Action as _Ros2Action
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.action._action_spec import HasFeedback as _HasFeedback
from actionlib_core.action._action_spec import HasGoal as _HasGoal
from actionlib_core.action._action_spec import HasResult as _HasResult

class ExecuteMotionPrimitiveSequence(_Ros2Action):
    Goal: _TypeAlias = ExecuteMotionPrimitiveSequence_Goal
    Result: _TypeAlias = ExecuteMotionPrimitiveSequence_Result
    Feedback: _TypeAlias = ExecuteMotionPrimitiveSequence_Feedback
    action_goal: _HasGoal[ExecuteMotionPrimitiveSequence_Goal]
    action_result: _HasResult[ExecuteMotionPrimitiveSequence_Result]
    action_feedback: _HasFeedback[ExecuteMotionPrimitiveSequence_Feedback]

class ExecuteMotionPrimitiveSequence_Goal(_Ros2Message):
    trajectory: _control_msgs_msg.MotionPrimitiveSequence
    def __init__(
        self,
        trajectory: _control_msgs_msg.MotionPrimitiveSequence | None = None,
    ) -> None: ...

class ExecuteMotionPrimitiveSequence_Result(_Ros2Message):
    SUCCESSFUL: _Final = 0
    INVALID_GOAL: _Final = -1
    OLD_HEADER_TIMESTAMP: _Final = -3
    error_code: int
    error_string: str
    def __init__(
        self,
        error_code: int | None = None,
        error_string: str | None = None,
    ) -> None: ...

class ExecuteMotionPrimitiveSequence_Feedback(_Ros2Message):
    current_primitive_index: int
    def __init__(
        self,
        current_primitive_index: int | None = None,
    ) -> None: ...

class FollowJointTrajectory(_Ros2Action):
    Goal: _TypeAlias = FollowJointTrajectory_Goal
    Result: _TypeAlias = FollowJointTrajectory_Result
    Feedback: _TypeAlias = FollowJointTrajectory_Feedback
    action_goal: _HasGoal[FollowJointTrajectory_Goal]
    action_result: _HasResult[FollowJointTrajectory_Result]
    action_feedback: _HasFeedback[FollowJointTrajectory_Feedback]

class FollowJointTrajectory_Goal(_Ros2Message):
    trajectory: _trajectory_msgs_msg.JointTrajectory
    multi_dof_trajectory: _trajectory_msgs_msg.MultiDOFJointTrajectory
    path_tolerance: list[_control_msgs_msg.JointTolerance]
    component_path_tolerance: list[_control_msgs_msg.JointComponentTolerance]
    goal_tolerance: list[_control_msgs_msg.JointTolerance]
    component_goal_tolerance: list[_control_msgs_msg.JointComponentTolerance]
    goal_time_tolerance: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        trajectory: _trajectory_msgs_msg.JointTrajectory | None = None,
        multi_dof_trajectory: _trajectory_msgs_msg.MultiDOFJointTrajectory | None = None,
        path_tolerance: _Collection[_control_msgs_msg.JointTolerance] | None = None,
        component_path_tolerance: _Collection[_control_msgs_msg.JointComponentTolerance] | None = None,
        goal_tolerance: _Collection[_control_msgs_msg.JointTolerance] | None = None,
        component_goal_tolerance: _Collection[_control_msgs_msg.JointComponentTolerance] | None = None,
        goal_time_tolerance: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class FollowJointTrajectory_Result(_Ros2Message):
    SUCCESSFUL: _Final = 0
    INVALID_GOAL: _Final = -1
    INVALID_JOINTS: _Final = -2
    OLD_HEADER_TIMESTAMP: _Final = -3
    PATH_TOLERANCE_VIOLATED: _Final = -4
    GOAL_TOLERANCE_VIOLATED: _Final = -5
    error_code: int
    error_string: str
    def __init__(
        self,
        error_code: int | None = None,
        error_string: str | None = None,
    ) -> None: ...

class FollowJointTrajectory_Feedback(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    desired: _trajectory_msgs_msg.JointTrajectoryPoint
    actual: _trajectory_msgs_msg.JointTrajectoryPoint
    error: _trajectory_msgs_msg.JointTrajectoryPoint
    multi_dof_joint_names: list[str]
    multi_dof_desired: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    multi_dof_actual: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    multi_dof_error: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        desired: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        actual: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        error: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        multi_dof_joint_names: _Collection[str] | None = None,
        multi_dof_desired: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        multi_dof_actual: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        multi_dof_error: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
    ) -> None: ...

class GripperCommand(_Ros2Action):
    Goal: _TypeAlias = GripperCommand_Goal
    Result: _TypeAlias = GripperCommand_Result
    Feedback: _TypeAlias = GripperCommand_Feedback
    action_goal: _HasGoal[GripperCommand_Goal]
    action_result: _HasResult[GripperCommand_Result]
    action_feedback: _HasFeedback[GripperCommand_Feedback]

class GripperCommand_Goal(_Ros2Message):
    command: _control_msgs_msg.GripperCommand
    def __init__(
        self,
        command: _control_msgs_msg.GripperCommand | None = None,
    ) -> None: ...

class GripperCommand_Result(_Ros2Message):
    position: float
    effort: float
    stalled: bool
    reached_goal: bool
    def __init__(
        self,
        position: float | None = None,
        effort: float | None = None,
        stalled: bool | None = None,
        reached_goal: bool | None = None,
    ) -> None: ...

class GripperCommand_Feedback(_Ros2Message):
    position: float
    effort: float
    stalled: bool
    reached_goal: bool
    def __init__(
        self,
        position: float | None = None,
        effort: float | None = None,
        stalled: bool | None = None,
        reached_goal: bool | None = None,
    ) -> None: ...

class JointTrajectory(_Ros2Action):
    Goal: _TypeAlias = JointTrajectory_Goal
    Result: _TypeAlias = JointTrajectory_Result
    Feedback: _TypeAlias = JointTrajectory_Feedback
    action_goal: _HasGoal[JointTrajectory_Goal]
    action_result: _HasResult[JointTrajectory_Result]
    action_feedback: _HasFeedback[JointTrajectory_Feedback]

class JointTrajectory_Goal(_Ros2Message):
    trajectory: _trajectory_msgs_msg.JointTrajectory
    def __init__(
        self,
        trajectory: _trajectory_msgs_msg.JointTrajectory | None = None,
    ) -> None: ...

class JointTrajectory_Result(_Ros2Message):
    def __init__(self) -> None: ...

class JointTrajectory_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class ParallelGripperCommand(_Ros2Action):
    Goal: _TypeAlias = ParallelGripperCommand_Goal
    Result: _TypeAlias = ParallelGripperCommand_Result
    Feedback: _TypeAlias = ParallelGripperCommand_Feedback
    action_goal: _HasGoal[ParallelGripperCommand_Goal]
    action_result: _HasResult[ParallelGripperCommand_Result]
    action_feedback: _HasFeedback[ParallelGripperCommand_Feedback]

class ParallelGripperCommand_Goal(_Ros2Message):
    command: _sensor_msgs_msg.JointState
    def __init__(
        self,
        command: _sensor_msgs_msg.JointState | None = None,
    ) -> None: ...

class ParallelGripperCommand_Result(_Ros2Message):
    state: _sensor_msgs_msg.JointState
    stalled: bool
    reached_goal: bool
    def __init__(
        self,
        state: _sensor_msgs_msg.JointState | None = None,
        stalled: bool | None = None,
        reached_goal: bool | None = None,
    ) -> None: ...

class ParallelGripperCommand_Feedback(_Ros2Message):
    state: _sensor_msgs_msg.JointState
    def __init__(
        self,
        state: _sensor_msgs_msg.JointState | None = None,
    ) -> None: ...

class PointHead(_Ros2Action):
    Goal: _TypeAlias = PointHead_Goal
    Result: _TypeAlias = PointHead_Result
    Feedback: _TypeAlias = PointHead_Feedback
    action_goal: _HasGoal[PointHead_Goal]
    action_result: _HasResult[PointHead_Result]
    action_feedback: _HasFeedback[PointHead_Feedback]

class PointHead_Goal(_Ros2Message):
    target: _geometry_msgs_msg.PointStamped
    pointing_axis: _geometry_msgs_msg.Vector3
    pointing_frame: str
    min_duration: _builtin_interfaces_msg.Duration
    max_velocity: float
    def __init__(
        self,
        target: _geometry_msgs_msg.PointStamped | None = None,
        pointing_axis: _geometry_msgs_msg.Vector3 | None = None,
        pointing_frame: str | None = None,
        min_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        max_velocity: float | None = None,
    ) -> None: ...

class PointHead_Result(_Ros2Message):
    def __init__(self) -> None: ...

class PointHead_Feedback(_Ros2Message):
    pointing_angle_error: float
    def __init__(
        self,
        pointing_angle_error: float | None = None,
    ) -> None: ...

class SingleJointPosition(_Ros2Action):
    Goal: _TypeAlias = SingleJointPosition_Goal
    Result: _TypeAlias = SingleJointPosition_Result
    Feedback: _TypeAlias = SingleJointPosition_Feedback
    action_goal: _HasGoal[SingleJointPosition_Goal]
    action_result: _HasResult[SingleJointPosition_Result]
    action_feedback: _HasFeedback[SingleJointPosition_Feedback]

class SingleJointPosition_Goal(_Ros2Message):
    position: float
    min_duration: _builtin_interfaces_msg.Duration
    max_velocity: float
    def __init__(
        self,
        position: float | None = None,
        min_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        max_velocity: float | None = None,
    ) -> None: ...

class SingleJointPosition_Result(_Ros2Message):
    def __init__(self) -> None: ...

class SingleJointPosition_Feedback(_Ros2Message):
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
