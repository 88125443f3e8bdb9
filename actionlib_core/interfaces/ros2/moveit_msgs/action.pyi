# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.moveit_msgs.msg as _moveit_msgs_msg
from actionlib_core.interfaces import Ros2Action as _Ros2Action
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.action._action_spec import HasFeedback as _HasFeedback
from actionlib_core.action._action_spec import HasGoal as _HasGoal
from actionlib_core.action._action_spec import HasResult as _HasResult

class ExecuteTrajectory(_Ros2Action):
    Goal: _TypeAlias = ExecuteTrajectory_Goal
    Result: _TypeAlias = ExecuteTrajectory_Result
    Feedback: _TypeAlias = ExecuteTrajectory_Feedback
    action_goal: _HasGoal[ExecuteTrajectory_Goal]
    action_result: _HasResult[ExecuteTrajectory_Result]
    action_feedback: _HasFeedback[ExecuteTrajectory_Feedback]

class ExecuteTrajectory_Goal(_Ros2Message):
    trajectory: _moveit_msgs_msg.RobotTrajectory
    controller_names: list[str]
    def __init__(
        self,
        trajectory: _moveit_msgs_msg.RobotTrajectory | None = None,
        controller_names: _Collection[str] | None = None,
    ) -> None: ...

class ExecuteTrajectory_Result(_Ros2Message):
    error_code: _moveit_msgs_msg.MoveItErrorCodes
    def __init__(
        self,
        error_code: _moveit_msgs_msg.MoveItErrorCodes | None = None,
    ) -> None: ...

class ExecuteTrajectory_Feedback(_Ros2Message):
    state: str
    def __init__(
        self,
        state: str | None = None,
    ) -> None: ...

class MoveGroup(_Ros2Action):
    Goal: _TypeAlias = MoveGroup_Goal
    Result: _TypeAlias = MoveGroup_Result
    Feedback: _TypeAlias = MoveGroup_Feedback
    action_goal: _HasGoal[MoveGroup_Goal]
    action_result: _HasResult[MoveGroup_Result]
    action_feedback: _HasFeedback[MoveGroup_Feedback]

class MoveGroup_Goal(_Ros2Message):
    request: _moveit_msgs_msg.MotionPlanRequest
    planning_options: _moveit_msgs_msg.PlanningOptions
    def __init__(
        self,
        request: _moveit_msgs_msg.MotionPlanRequest | None = None,
        planning_options: _moveit_msgs_msg.PlanningOptions | None = None,
    ) -> None: ...

class MoveGroup_Result(_Ros2Message):
    error_code: _moveit_msgs_msg.MoveItErrorCodes
    trajectory_start: _moveit_msgs_msg.RobotState
    planned_trajectory: _moveit_msgs_msg.RobotTrajectory
    executed_trajectory: _moveit_msgs_msg.RobotTrajectory
    planning_time: float
    def __init__(
        self,
        error_code: _moveit_msgs_msg.MoveItErrorCodes | None = None,
        trajectory_start: _moveit_msgs_msg.RobotState | None = None,
        planned_trajectory: _moveit_msgs_msg.RobotTrajectory | None = None,
        executed_trajectory: _moveit_msgs_msg.RobotTrajectory | None = None,
        planning_time: float | None = None,
    ) -> None: ...

class MoveGroup_Feedback(_Ros2Message):
    state: str
    def __init__(
        self,
        state: str | None = None,
    ) -> None: ...
