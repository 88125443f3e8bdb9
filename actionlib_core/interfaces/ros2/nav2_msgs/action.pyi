# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geographic_msgs.msg as _geographic_msgs_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.nav2_msgs.msg as _nav2_msgs_msg
import actionlib_core.interfaces.ros2.nav_msgs.msg as _nav_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Action as _Ros2Action
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.action._action_spec import HasFeedback as _HasFeedback
from actionlib_core.action._action_spec import HasGoal as _HasGoal
from actionlib_core.action._action_spec import HasResult as _HasResult

class AssistedTeleop(_Ros2Action):
    Goal: _TypeAlias = AssistedTeleop_Goal
    Result: _TypeAlias = AssistedTeleop_Result
    Feedback: _TypeAlias = AssistedTeleop_Feedback
    action_goal: _HasGoal[AssistedTeleop_Goal]
    action_result: _HasResult[AssistedTeleop_Result]
    action_feedback: _HasFeedback[AssistedTeleop_Feedback]

class AssistedTeleop_Goal(_Ros2Message):
    time_allowance: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        time_allowance: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class AssistedTeleop_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 730
    TIMEOUT: _Final = 731
    TF_ERROR: _Final = 732
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class AssistedTeleop_Feedback(_Ros2Message):
    current_teleop_duration: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        current_teleop_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class BackUp(_Ros2Action):
    Goal: _TypeAlias = BackUp_Goal
    Result: _TypeAlias = BackUp_Result
    Feedback: _TypeAlias = BackUp_Feedback
    action_goal: _HasGoal[BackUp_Goal]
    action_result: _HasResult[BackUp_Result]
    action_feedback: _HasFeedback[BackUp_Feedback]

class BackUp_Goal(_Ros2Message):
    target: _geometry_msgs_msg.Point
    speed: float
    time_allowance: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        target: _geometry_msgs_msg.Point | None = None,
        speed: float | None = None,
        time_allowance: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class BackUp_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 710
    TIMEOUT: _Final = 711
    TF_ERROR: _Final = 712
    INVALID_INPUT: _Final = 713
    COLLISION_AHEAD: _Final = 714
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class BackUp_Feedback(_Ros2Message):
    distance_traveled: float
    def __init__(
        self,
        distance_traveled: float | None = None,
    ) -> None: ...

class ComputeAndTrackRoute(_Ros2Action):
    Goal: _TypeAlias = ComputeAndTrackRoute_Goal
    Result: _TypeAlias = ComputeAndTrackRoute_Result
    Feedback: _TypeAlias = ComputeAndTrackRoute_Feedback
    action_goal: _HasGoal[ComputeAndTrackRoute_Goal]
    action_result: _HasResult[ComputeAndTrackRoute_Result]
    action_feedback: _HasFeedback[ComputeAndTrackRoute_Feedback]

class ComputeAndTrackRoute_Goal(_Ros2Message):
    start_id: int
    start: _geometry_msgs_msg.PoseStamped
    goal_id: int
    goal: _geometry_msgs_msg.PoseStamped
    use_start: bool
    use_poses: bool
    def __init__(
        self,
        start_id: int | None = None,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        goal_id: int | None = None,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        use_start: bool | None = None,
        use_poses: bool | None = None,
    ) -> None: ...

class ComputeAndTrackRoute_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 400
    TF_ERROR: _Final = 401
    NO_VALID_GRAPH: _Final = 402
    INDETERMINANT_NODES_ON_GRAPH: _Final = 403
    TIMEOUT: _Final = 404
    NO_VALID_ROUTE: _Final = 405
    OPERATION_FAILED: _Final = 406
    INVALID_EDGE_SCORER_USE: _Final = 407
    execution_duration: _builtin_interfaces_msg.Duration
    error_code: int
    def __init__(
        self,
        execution_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
    ) -> None: ...

class ComputeAndTrackRoute_Feedback(_Ros2Message):
    last_node_id: int
    next_node_id: int
    current_edge_id: int
    route: _nav2_msgs_msg.Route
    path: _nav_msgs_msg.Path
    operations_triggered: list[str]
    rerouted: bool
    def __init__(
        self,
        last_node_id: int | None = None,
        next_node_id: int | None = None,
        current_edge_id: int | None = None,
        route: _nav2_msgs_msg.Route | None = None,
        path: _nav_msgs_msg.Path | None = None,
        operations_triggered: _Collection[str] | None = None,
        rerouted: bool | None = None,
    ) -> None: ...

class ComputePathThroughPoses(_Ros2Action):
    Goal: _TypeAlias = ComputePathThroughPoses_Goal
    Result: _TypeAlias = ComputePathThroughPoses_Result
    Feedback: _TypeAlias = ComputePathThroughPoses_Feedback
    action_goal: _HasGoal[ComputePathThroughPoses_Goal]
    action_result: _HasResult[ComputePathThroughPoses_Result]
    action_feedback: _HasFeedback[ComputePathThroughPoses_Feedback]

class ComputePathThroughPoses_Goal(_Ros2Message):
    goals: list[_geometry_msgs_msg.PoseStamped]
    start: _geometry_msgs_msg.PoseStamped
    planner_id: str
    use_start: bool
    def __init__(
        self,
        goals: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        planner_id: str | None = None,
        use_start: bool | None = None,
    ) -> None: ...

class ComputePathThroughPoses_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 300
    INVALID_PLANNER: _Final = 301
    TF_ERROR: _Final = 302
    START_OUTSIDE_MAP: _Final = 303
    GOAL_OUTSIDE_MAP: _Final = 304
    START_OCCUPIED: _Final = 305
    GOAL_OCCUPIED: _Final = 306
    TIMEOUT: _Final = 307
    NO_VALID_PATH: _Final = 308
    NO_VIAPOINTS_GIVEN: _Final = 309
    path: _nav_msgs_msg.Path
    planning_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
        planning_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class ComputePathThroughPoses_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class ComputePathToPose(_Ros2Action):
    Goal: _TypeAlias = ComputePathToPose_Goal
    Result: _TypeAlias = ComputePathToPose_Result
    Feedback: _TypeAlias = ComputePathToPose_Feedback
    action_goal: _HasGoal[ComputePathToPose_Goal]
    action_result: _HasResult[ComputePathToPose_Result]
    action_feedback: _HasFeedback[ComputePathToPose_Feedback]

class ComputePathToPose_Goal(_Ros2Message):
    goal: _geometry_msgs_msg.PoseStamped
    start: _geometry_msgs_msg.PoseStamped
    planner_id: str
    use_start: bool
    def __init__(
        self,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        planner_id: str | None = None,
        use_start: bool | None = None,
    ) -> None: ...

class ComputePathToPose_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 200
    INVALID_PLANNER: _Final = 201
    TF_ERROR: _Final = 202
    START_OUTSIDE_MAP: _Final = 203
    GOAL_OUTSIDE_MAP: _Final = 204
    START_OCCUPIED: _Final = 205
    GOAL_OCCUPIED: _Final = 206
    TIMEOUT: _Final = 207
    NO_VALID_PATH: _Final = 208
    path: _nav_msgs_msg.Path
    planning_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
        planning_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class ComputePathToPose_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class ComputeRoute(_Ros2Action):
    Goal: _TypeAlias = ComputeRoute_Goal
    Result: _TypeAlias = ComputeRoute_Result
    Feedback: _TypeAlias = ComputeRoute_Feedback
    action_goal: _HasGoal[ComputeRoute_Goal]
    action_result: _HasResult[ComputeRoute_Result]
    action_feedback: _HasFeedback[ComputeRoute_Feedback]

class ComputeRoute_Goal(_Ros2Message):
    start_id: int
    start: _geometry_msgs_msg.PoseStamped
    goal_id: int
    goal: _geometry_msgs_msg.PoseStamped
    use_start: bool
    use_poses: bool
    def __init__(
        self,
        start_id: int | None = None,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        goal_id: int | None = None,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        use_start: bool | None = None,
        use_poses: bool | None = None,
    ) -> None: ...

class ComputeRoute_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 400
    TF_ERROR: _Final = 401
    NO_VALID_GRAPH: _Final = 402
    INDETERMINANT_NODES_ON_GRAPH: _Final = 403
    TIMEOUT: _Final = 404
    NO_VALID_ROUTE: _Final = 405
    INVALID_EDGE_SCORER_USE: _Final = 407
    planning_time: _builtin_interfaces_msg.Duration
    path: _nav_msgs_msg.Path
    route: _nav2_msgs_msg.Route
    error_code: int
    def __init__(
        self,
        planning_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        path: _nav_msgs_msg.Path | None = None,
        route: _nav2_msgs_msg.Route | None = None,
        error_code: int | None = None,
    ) -> None: ...

class ComputeRoute_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class DockRobot(_Ros2Action):
    Goal: _TypeAlias = DockRobot_Goal
    Result: _TypeAlias = DockRobot_Result
    Feedback: _TypeAlias = DockRobot_Feedback
    action_goal: _HasGoal[DockRobot_Goal]
    action_result: _HasResult[DockRobot_Result]
    action_feedback: _HasFeedback[DockRobot_Feedback]

class DockRobot_Goal(_Ros2Message):
    use_dock_id: bool
    dock_id: str
    dock_pose: _geometry_msgs_msg.PoseStamped
    dock_type: str
    max_staging_time: float
    navigate_to_staging_pose: bool
    def __init__(
        self,
        use_dock_id: bool | None = None,
        dock_id: str | None = None,
        dock_pose: _geometry_msgs_msg.PoseStamped | None = None,
        dock_type: str | None = None,
        max_staging_time: float | None = None,
        navigate_to_staging_pose: bool | None = None,
    ) -> None: ...

class DockRobot_Result(_Ros2Message):
    NONE: _Final = 0
    DOCK_NOT_IN_DB: _Final = 901
    DOCK_NOT_VALID: _Final = 902
    FAILED_TO_STAGE: _Final = 903
    FAILED_TO_DETECT_DOCK: _Final = 904
    FAILED_TO_CONTROL: _Final = 905
    FAILED_TO_CHARGE: _Final = 906
    UNKNOWN: _Final = 999
    success: bool
    error_code: int
    num_retries: int
    error_msg: str
    def __init__(
        self,
        success: bool | None = None,
        error_code: int | None = None,
        num_retries: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class DockRobot_Feedback(_Ros2Message):
    NONE: _Final = 0
    NAV_TO_STAGING_POSE: _Final = 1
    INITIAL_PERCEPTION: _Final = 2
    CONTROLLING: _Final = 3
    WAIT_FOR_CHARGE: _Final = 4
    RETRY: _Final = 5
    state: int
    docking_time: _builtin_interfaces_msg.Duration
    num_retries: int
    def __init__(
        self,
        state: int | None = None,
        docking_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        num_retries: int | None = None,
    ) -> None: ...

class DriveOnHeading(_Ros2Action):
    Goal: _TypeAlias = DriveOnHeading_Goal
    Result: _TypeAlias = DriveOnHeading_Result
    Feedback: _TypeAlias = DriveOnHeading_Feedback
    action_goal: _HasGoal[DriveOnHeading_Goal]
    action_result: _HasResult[DriveOnHeading_Result]
    action_feedback: _HasFeedback[DriveOnHeading_Feedback]

class DriveOnHeading_Goal(_Ros2Message):
    target: _geometry_msgs_msg.Point
    speed: float
    time_allowance: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        target: _geometry_msgs_msg.Point | None = None,
        speed: float | None = None,
        time_allowance: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class DriveOnHeading_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 720
    TIMEOUT: _Final = 721
    TF_ERROR: _Final = 722
    COLLISION_AHEAD: _Final = 723
    INVALID_INPUT: _Final = 724
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class DriveOnHeading_Feedback(_Ros2Message):
    distance_traveled: float
    def __init__(
        self,
        distance_traveled: float | None = None,
    ) -> None: ...

class DummyBehavior(_Ros2Action):
    Goal: _TypeAlias = DummyBehavior_Goal
    Result: _TypeAlias = DummyBehavior_Result
    Feedback: _TypeAlias = DummyBehavior_Feedback
    action_goal: _HasGoal[DummyBehavior_Goal]
    action_result: _HasResult[DummyBehavior_Result]
    action_feedback: _HasFeedback[DummyBehavior_Feedback]

class DummyBehavior_Goal(_Ros2Message):
    command: _std_msgs_msg.String
    def __init__(
        self,
        command: _std_msgs_msg.String | None = None,
    ) -> None: ...

class DummyBehavior_Result(_Ros2Message):
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class DummyBehavior_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class FollowGPSWaypoints(_Ros2Action):
    Goal: _TypeAlias = FollowGPSWaypoints_Goal
    Result: _TypeAlias = FollowGPSWaypoints_Result
    Feedback: _TypeAlias = FollowGPSWaypoints_Feedback
    action_goal: _HasGoal[FollowGPSWaypoints_Goal]
    action_result: _HasResult[FollowGPSWaypoints_Result]
    action_feedback: _HasFeedback[FollowGPSWaypoints_Feedback]

class FollowGPSWaypoints_Goal(_Ros2Message):
    number_of_loops: int
    goal_index: int
    gps_poses: list[_geographic_msgs_msg.GeoPose]
    def __init__(
        self,
        number_of_loops: int | None = None,
        goal_index: int | None = None,
        gps_poses: _Collection[_geographic_msgs_msg.GeoPose] | None = None,
    ) -> None: ...

class FollowGPSWaypoints_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 600
    TASK_EXECUTOR_FAILED: _Final = 601
    missed_waypoints: list[_nav2_msgs_msg.MissedWaypoint]
    error_code: int
    error_msg: str
    def __init__(
        self,
        missed_waypoints: _Collection[_nav2_msgs_msg.MissedWaypoint] | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class FollowGPSWaypoints_Feedback(_Ros2Message):
    current_waypoint: int
    def __init__(
        self,
        current_waypoint: int | None = None,
    ) -> None: ...

class FollowObject(_Ros2Action):
    Goal: _TypeAlias = FollowObject_Goal
    Result: _TypeAlias = FollowObject_Result
    Feedback: _TypeAlias = FollowObject_Feedback
    action_goal: _HasGoal[FollowObject_Goal]
    action_result: _HasResult[FollowObject_Result]
    action_feedback: _HasFeedback[FollowObject_Feedback]

class FollowObject_Goal(_Ros2Message):
    pose_topic: str
    tracked_frame: str
    max_duration: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        pose_topic: str | None = None,
        tracked_frame: str | None = None,
        max_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class FollowObject_Result(_Ros2Message):
    NONE: _Final = 0
    TF_ERROR: _Final = 901
    FAILED_TO_DETECT_OBJECT: _Final = 902
    FAILED_TO_CONTROL: _Final = 903
    TIMEOUT: _Final = 904
    UNKNOWN: _Final = 999
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    num_retries: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        num_retries: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class FollowObject_Feedback(_Ros2Message):
    NONE: _Final = 0
    INITIAL_PERCEPTION: _Final = 1
    CONTROLLING: _Final = 2
    STOPPING: _Final = 3
    RETRY: _Final = 4
    state: int
    following_time: _builtin_interfaces_msg.Duration
    num_retries: int
    def __init__(
        self,
        state: int | None = None,
        following_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        num_retries: int | None = None,
    ) -> None: ...

class FollowPath(_Ros2Action):
    Goal: _TypeAlias = FollowPath_Goal
    Result: _TypeAlias = FollowPath_Result
    Feedback: _TypeAlias = FollowPath_Feedback
    action_goal: _HasGoal[FollowPath_Goal]
    action_result: _HasResult[FollowPath_Result]
    action_feedback: _HasFeedback[FollowPath_Feedback]

class FollowPath_Goal(_Ros2Message):
    path: _nav_msgs_msg.Path
    controller_id: str
    goal_checker_id: str
    progress_checker_id: str
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
        controller_id: str | None = None,
        goal_checker_id: str | None = None,
        progress_checker_id: str | None = None,
    ) -> None: ...

class FollowPath_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 100
    INVALID_CONTROLLER: _Final = 101
    TF_ERROR: _Final = 102
    INVALID_PATH: _Final = 103
    PATIENCE_EXCEEDED: _Final = 104
    FAILED_TO_MAKE_PROGRESS: _Final = 105
    NO_VALID_CONTROL: _Final = 106
    CONTROLLER_TIMED_OUT: _Final = 107
    result: _std_msgs_msg.Empty
    error_code: int
    error_msg: str
    def __init__(
        self,
        result: _std_msgs_msg.Empty | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class FollowPath_Feedback(_Ros2Message):
    distance_to_goal: float
    speed: float
    def __init__(
        self,
        distance_to_goal: float | None = None,
        speed: float | None = None,
    ) -> None: ...

class FollowWaypoints(_Ros2Action):
    Goal: _TypeAlias = FollowWaypoints_Goal
    Result: _TypeAlias = FollowWaypoints_Result
    Feedback: _TypeAlias = FollowWaypoints_Feedback
    action_goal: _HasGoal[FollowWaypoints_Goal]
    action_result: _HasResult[FollowWaypoints_Result]
    action_feedback: _HasFeedback[FollowWaypoints_Feedback]

class FollowWaypoints_Goal(_Ros2Message):
    number_of_loops: int
    goal_index: int
    poses: list[_geometry_msgs_msg.PoseStamped]
    def __init__(
        self,
        number_of_loops: int | None = None,
        goal_index: int | None = None,
        poses: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
    ) -> None: ...

class FollowWaypoints_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 600
    TASK_EXECUTOR_FAILED: _Final = 601
    missed_waypoints: list[_nav2_msgs_msg.MissedWaypoint]
    error_code: int
    error_msg: str
    def __init__(
        self,
        missed_waypoints: _Collection[_nav2_msgs_msg.MissedWaypoint] | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class FollowWaypoints_Feedback(_Ros2Message):
    current_waypoint: int
    def __init__(
        self,
        current_waypoint: int | None = None,
    ) -> None: ...

class NavigateThroughPoses(_Ros2Action):
    Goal: _TypeAlias = NavigateThroughPoses_Goal
    Result: _TypeAlias = NavigateThroughPoses_Result
    Feedback: _TypeAlias = NavigateThroughPoses_Feedback
    action_goal: _HasGoal[NavigateThroughPoses_Goal]
    action_result: _HasResult[NavigateThroughPoses_Result]
    action_feedback: _HasFeedback[NavigateThroughPoses_Feedback]

class NavigateThroughPoses_Goal(_Ros2Message):
    poses: list[_geometry_msgs_msg.PoseStamped]
    behavior_tree: str
    def __init__(
        self,
        poses: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
        behavior_tree: str | None = None,
    ) -> None: ...

class NavigateThroughPoses_Result(_Ros2Message):
    NONE: _Final = 0
    error_code: int
    error_msg: str
    def __init__(
        self,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class NavigateThroughPoses_Feedback(_Ros2Message):
    current_pose: _geometry_msgs_msg.PoseStamped
    navigation_time: _builtin_interfaces_msg.Duration
    estimated_time_remaining: _builtin_interfaces_msg.Duration
    number_of_recoveries: int
    distance_remaining: float
    number_of_poses_remaining: int
    def __init__(
        self,
        current_pose: _geometry_msgs_msg.PoseStamped | None = None,
        navigation_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        estimated_time_remaining: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        number_of_recoveries: int | None = None,
        distance_remaining: float | None = None,
        number_of_poses_remaining: int | None = None,
    ) -> None: ...

class NavigateToPose(_Ros2Action):
    Goal: _TypeAlias = NavigateToPose_Goal
    Result: _TypeAlias = NavigateToPose_Result
    Feedback: _TypeAlias = NavigateToPose_Feedback
    action_goal: _HasGoal[NavigateToPose_Goal]
    action_result: _HasResult[NavigateToPose_Result]
    action_feedback: _HasFeedback[NavigateToPose_Feedback]

class NavigateToPose_Goal(_Ros2Message):
    pose: _geometry_msgs_msg.PoseStamped
    behavior_tree: str
    def __init__(
        self,
        pose: _geometry_msgs_msg.PoseStamped | None = None,
        behavior_tree: str | None = None,
    ) -> None: ...

class NavigateToPose_Result(_Ros2Message):
    NONE: _Final = 0
    error_code: int
    error_msg: str
    def __init__(
        self,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class NavigateToPose_Feedback(_Ros2Message):
    current_pose: _geometry_msgs_msg.PoseStamped
    navigation_time: _builtin_interfaces_msg.Duration
    estimated_time_remaining: _builtin_interfaces_msg.Duration
    number_of_recoveries: int
    distance_remaining: float
    def __init__(
        self,
        current_pose: _geometry_msgs_msg.PoseStamped | None = None,
        navigation_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        estimated_time_remaining: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        number_of_recoveries: int | None = None,
        distance_remaining: float | None = None,
    ) -> None: ...

class SmoothPath(_Ros2Action):
    Goal: _TypeAlias = SmoothPath_Goal
    Result: _TypeAlias = SmoothPath_Result
    Feedback: _TypeAlias = SmoothPath_Feedback
    action_goal: _HasGoal[SmoothPath_Goal]
    action_result: _HasResult[SmoothPath_Result]
    action_feedback: _HasFeedback[SmoothPath_Feedback]

class SmoothPath_Goal(_Ros2Message):
    path: _nav_msgs_msg.Path
    smoother_id: str
    max_smoothing_duration: _builtin_interfaces_msg.Duration
    check_for_collisions: bool
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
        smoother_id: str | None = None,
        max_smoothing_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        check_for_collisions: bool | None = None,
    ) -> None: ...

class SmoothPath_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 500
    INVALID_SMOOTHER: _Final = 501
    TIMEOUT: _Final = 502
    SMOOTHED_PATH_IN_COLLISION: _Final = 503
    FAILED_TO_SMOOTH_PATH: _Final = 504
    INVALID_PATH: _Final = 505
    path: _nav_msgs_msg.Path
    smoothing_duration: _builtin_interfaces_msg.Duration
    was_completed: bool
    error_code: int
    error_msg: str
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
        smoothing_duration: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        was_completed: bool | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class SmoothPath_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class Spin(_Ros2Action):
    Goal: _TypeAlias = Spin_Goal
    Result: _TypeAlias = Spin_Result
    Feedback: _TypeAlias = Spin_Feedback
    action_goal: _HasGoal[Spin_Goal]
    action_result: _HasResult[Spin_Result]
    action_feedback: _HasFeedback[Spin_Feedback]

class Spin_Goal(_Ros2Message):
    target_yaw: float
    time_allowance: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        target_yaw: float | None = None,
        time_allowance: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class Spin_Result(_Ros2Message):
    NONE: _Final = 0
    UNKNOWN: _Final = 700
    TIMEOUT: _Final = 701
    TF_ERROR: _Final = 702
    COLLISION_AHEAD: _Final = 703
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class Spin_Feedback(_Ros2Message):
    angular_distance_traveled: float
    def __init__(
        self,
        angular_distance_traveled: float | None = None,
    ) -> None: ...

class UndockRobot(_Ros2Action):
    Goal: _TypeAlias = UndockRobot_Goal
    Result: _TypeAlias = UndockRobot_Result
    Feedback: _TypeAlias = UndockRobot_Feedback
    action_goal: _HasGoal[UndockRobot_Goal]
    action_result: _HasResult[UndockRobot_Result]
    action_feedback: _HasFeedback[UndockRobot_Feedback]

class UndockRobot_Goal(_Ros2Message):
    dock_type: str
    max_undocking_time: float
    def __init__(
        self,
        dock_type: str | None = None,
        max_undocking_time: float | None = None,
    ) -> None: ...

class UndockRobot_Result(_Ros2Message):
    NONE: _Final = 0
    DOCK_NOT_VALID: _Final = 902
    FAILED_TO_CONTROL: _Final = 905
    UNKNOWN: _Final = 999
    success: bool
    error_code: int
    error_msg: str
    def __init__(
        self,
        success: bool | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class UndockRobot_Feedback(_Ros2Message):
    def __init__(self) -> None: ...

class Wait(_Ros2Action):
    Goal: _TypeAlias = Wait_Goal
    Result: _TypeAlias = Wait_Result
    Feedback: _TypeAlias = Wait_Feedback
    action_goal: _HasGoal[Wait_Goal]
    action_result: _HasResult[Wait_Result]
    action_feedback: _HasFeedback[Wait_Feedback]

class Wait_Goal(_Ros2Message):
    time: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class Wait_Result(_Ros2Message):
    total_elapsed_time: _builtin_interfaces_msg.Duration
    error_code: int
    error_msg: str
    def __init__(
        self,
        total_elapsed_time: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error_code: int | None = None,
        error_msg: str | None = None,
    ) -> None: ...

class Wait_Feedback(_Ros2Message):
    time_left: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        time_left: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...
