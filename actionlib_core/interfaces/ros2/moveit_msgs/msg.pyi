# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.object_recognition_msgs.msg as _object_recognition_msgs_msg
import actionlib_core.interfaces.ros2.octomap_msgs.msg as _octomap_msgs_msg
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.ros2.shape_msgs.msg as _shape_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
import actionlib_core.interfaces.ros2.trajectory_msgs.msg as _trajectory_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration

class AllowedCollisionEntry(_Ros2Message):
    enabled: list[bool]
    def __init__(
        self,
        enabled: _Collection[bool] | None = None,
    ) -> None: ...

class AllowedCollisionMatrix(_Ros2Message):
    entry_names: list[str]
    entry_values: list[AllowedCollisionEntry]
    default_entry_names: list[str]
    default_entry_values: list[bool]
    def __init__(
        self,
        entry_names: _Collection[str] | None = None,
        entry_values: _Collection[AllowedCollisionEntry] | None = None,
        default_entry_names: _Collection[str] | None = None,
        default_entry_values: _Collection[bool] | None = None,
    ) -> None: ...

class AttachedCollisionObject(_Ros2Message):
    link_name: str
    object: CollisionObject
    touch_links: list[str]
    detach_posture: _trajectory_msgs_msg.JointTrajectory
    weight: float
    def __init__(
        self,
        link_name: str | None = None,
        object: CollisionObject | None = None,
        touch_links: _Collection[str] | None = None,
        detach_posture: _trajectory_msgs_msg.JointTrajectory | None = None,
        weight: float | None = None,
    ) -> None: ...

class BoundingVolume(_Ros2Message):
    primitives: list[_shape_msgs_msg.SolidPrimitive]
    primitive_poses: list[_geometry_msgs_msg.Pose]
    meshes: list[_shape_msgs_msg.Mesh]
    mesh_poses: list[_geometry_msgs_msg.Pose]
    def __init__(
        self,
        primitives: _Collection[_shape_msgs_msg.SolidPrimitive] | None = None,
        primitive_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
        meshes: _Collection[_shape_msgs_msg.Mesh] | None = None,
        mesh_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
    ) -> None: ...

class CartesianPoint(_Ros2Message):
    pose: _geometry_msgs_msg.Pose
    velocity: _geometry_msgs_msg.Twist
    acceleration: _geometry_msgs_msg.Accel
    def __init__(
        self,
        pose: _geometry_msgs_msg.Pose | None = None,
        velocity: _geometry_msgs_msg.Twist | None = None,
        acceleration: _geometry_msgs_msg.Accel | None = None,
    ) -> None: ...

class CartesianTrajectory(_Ros2Message):
    header: _std_msgs_msg.Header
    tracked_frame: str
    points: list[CartesianTrajectoryPoint]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        tracked_frame: str | None = None,
        points: _Collection[CartesianTrajectoryPoint] | None = None,
    ) -> None: ...

class CartesianTrajectoryPoint(_Ros2Message):
    point: CartesianPoint
    time_from_start: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        point: CartesianPoint | None = None,
        time_from_start: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class CollisionObject(_Ros2Message):
    ADD: _Final = 0
    REMOVE: _Final = 1
    APPEND: _Final = 2
    MOVE: _Final = 3
    header: _std_msgs_msg.Header
    pose: _geometry_msgs_msg.Pose
    id: str
    type: _object_recognition_msgs_msg.ObjectType
    primitives: list[_shape_msgs_msg.SolidPrimitive]
    primitive_poses: list[_geometry_msgs_msg.Pose]
    meshes: list[_shape_msgs_msg.Mesh]
    mesh_poses: list[_geometry_msgs_msg.Pose]
    planes: list[_shape_msgs_msg.Plane]
    plane_poses: list[_geometry_msgs_msg.Pose]
    subframe_names: list[str]
    subframe_poses: list[_geometry_msgs_msg.Pose]
    operation: int
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: _geometry_msgs_msg.Pose | None = None,
        id: str | None = None,
        type: _object_recognition_msgs_msg.ObjectType | None = None,
        primitives: _Collection[_shape_msgs_msg.SolidPrimitive] | None = None,
        primitive_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
        meshes: _Collection[_shape_msgs_msg.Mesh] | None = None,
        mesh_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
        planes: _Collection[_shape_msgs_msg.Plane] | None = None,
        plane_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
        subframe_names: _Collection[str] | None = None,
        subframe_poses: _Collection[_geometry_msgs_msg.Pose] | None = None,
        operation: int | None = None,
    ) -> None: ...

class Constraints(_Ros2Message):
    name: str
    joint_constraints: list[JointConstraint]
    position_constraints: list[PositionConstraint]
    orientation_constraints: list[OrientationConstraint]
    visibility_constraints: list[VisibilityConstraint]
    def __init__(
        self,
        name: str | None = None,
        joint_constraints: _Collection[JointConstraint] | None = None,
        position_constraints: _Collection[PositionConstraint] | None = None,
        orientation_constraints: _Collection[OrientationConstraint] | None = None,
        visibility_constraints: _Collection[VisibilityConstraint] | None = None,
    ) -> None: ...

class GenericTrajectory(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_trajectory: list[_trajectory_msgs_msg.JointTrajectory]
    cartesian_trajectory: list[CartesianTrajectory]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_trajectory: _Collection[_trajectory_msgs_msg.JointTrajectory] | None = None,
        cartesian_trajectory: _Collection[CartesianTrajectory] | None = None,
    ) -> None: ...

class JointConstraint(_Ros2Message):
    joint_name: str
    position: float
    tolerance_above: float
    tolerance_below: float
    weight: float
    def __init__(
        self,
        joint_name: str | None = None,
        position: float | None = None,
        tolerance_above: float | None = None,
        tolerance_below: float | None = None,
        weight: float | None = None,
    ) -> None: ...

class LinkPadding(_Ros2Message):
    link_name: str
    padding: float
    def __init__(
        self,
        link_name: str | None = None,
        padding: float | None = None,
    ) -> None: ...

class LinkScale(_Ros2Message):
    link_name: str
    scale: float
    def __init__(
        self,
        link_name: str | None = None,
        scale: float | None = None,
    ) -> None: ...

class MotionPlanRequest(_Ros2Message):
    workspace_parameters: WorkspaceParameters
    start_state: RobotState
    goal_constraints: list[Constraints]
    path_constraints: Constraints
    trajectory_constraints: TrajectoryConstraints
    reference_trajectories: list[GenericTrajectory]
    pipeline_id: str
    planner_id: str
    group_name: str
    num_planning_attempts: int
    allowed_planning_time: float
    max_velocity_scaling_factor: float
    max_acceleration_scaling_factor: float
    cartesian_speed_limited_link: str
    max_cartesian_speed: float
    def __init__(
        self,
        workspace_parameters: WorkspaceParameters | None = None,
        start_state: RobotState | None = None,
        goal_constraints: _Collection[Constraints] | None = None,
        path_constraints: Constraints | None = None,
        trajectory_constraints: TrajectoryConstraints | None = None,
        reference_trajectories: _Collection[GenericTrajectory] | None = None,
        pipeline_id: str | None = None,
        planner_id: str | None = None,
        group_name: str | None = None,
        num_planning_attempts: int | None = None,
        allowed_planning_time: float | None = None,
        max_velocity_scaling_factor: float | None = None,
        max_acceleration_scaling_factor: float | None = None,
        cartesian_speed_limited_link: str | None = None,
        max_cartesian_speed: float | None = None,
    ) -> None: ...

class MoveItErrorCodes(_Ros2Message):
    SUCCESS: _Final = 1
    UNDEFINED: _Final = 0
    FAILURE: _Final = 99999
    PLANNING_FAILED: _Final = -1
    INVALID_MOTION_PLAN: _Final = -2
    MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE: _Final = -3
    CONTROL_FAILED: _Final = -4
    UNABLE_TO_AQUIRE_SENSOR_DATA: _Final = -5
    TIMED_OUT: _Final = -6
    PREEMPTED: _Final = -7
    START_STATE_IN_COLLISION: _Final = -10
    START_STATE_VIOLATES_PATH_CONSTRAINTS: _Final = -11
    START_STATE_INVALID: _Final = -26
    GOAL_IN_COLLISION: _Final = -12
    GOAL_VIOLATES_PATH_CONSTRAINTS: _Final = -13
    GOAL_CONSTRAINTS_VIOLATED: _Final = -14
    GOAL_STATE_INVALID: _Final = -27
    UNRECOGNIZED_GOAL_TYPE: _Final = -28
    INVALID_GROUP_NAME: _Final = -15
    INVALID_GOAL_CONSTRAINTS: _Final = -16
    INVALID_ROBOT_STATE: _Final = -17
    INVALID_LINK_NAME: _Final = -18
    INVALID_OBJECT_NAME: _Final = -19
    FRAME_TRANSFORM_FAILURE: _Final = -21
    COLLISION_CHECKING_UNAVAILABLE: _Final = -22
    ROBOT_STATE_STALE: _Final = -23
    SENSOR_INFO_STALE: _Final = -24
    COMMUNICATION_FAILURE: _Final = -25
    CRASH: _Final = -29
    ABORT: _Final = -30
    NO_IK_SOLUTION: _Final = -31
    val: int
    message: str
    source: str
    def __init__(
        self,
        val: int | None = None,
        message: str | None = None,
        source: str | None = None,
    ) -> None: ...

class ObjectColor(_Ros2Message):
    id: str
    color: _std_msgs_msg.ColorRGBA
    def __init__(
        self,
        id: str | None = None,
        color: _std_msgs_msg.ColorRGBA | None = None,
    ) -> None: ...

class OrientationConstraint(_Ros2Message):
    XYZ_EULER_ANGLES: _Final = 0
    ROTATION_VECTOR: _Final = 1
    header: _std_msgs_msg.Header
    orientation: _geometry_msgs_msg.Quaternion
    link_name: str
    absolute_x_axis_tolerance: float
    absolute_y_axis_tolerance: float
    absolute_z_axis_tolerance: float
    parameterization: int
    weight: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        orientation: _geometry_msgs_msg.Quaternion | None = None,
        link_name: str | None = None,
        absolute_x_axis_tolerance: float | None = None,
        absolute_y_axis_tolerance: float | None = None,
        absolute_z_axis_tolerance: float | None = None,
        parameterization: int | None = None,
        weight: float | None = None,
    ) -> None: ...

class PlanningOptions(_Ros2Message):
    planning_scene_diff: PlanningScene
    plan_only: bool
    look_around: bool
    look_around_attempts: int
    max_safe_execution_cost: float
    replan: bool
    replan_attempts: int
    replan_delay: float
    def __init__(
        self,
        planning_scene_diff: PlanningScene | None = None,
        plan_only: bool | None = None,
        look_around: bool | None = None,
        look_around_attempts: int | None = None,
        max_safe_execution_cost: float | None = None,
        replan: bool | None = None,
        replan_attempts: int | None = None,
        replan_delay: float | None = None,
    ) -> None: ...

class PlanningScene(_Ros2Message):
    name: str
    robot_state: RobotState
    robot_model_name: str
    fixed_frame_transforms: list[_geometry_msgs_msg.TransformStamped]
    allowed_collision_matrix: AllowedCollisionMatrix
    link_padding: list[LinkPadding]
    link_scale: list[LinkScale]
    object_colors: list[ObjectColor]
    world: PlanningSceneWorld
    is_diff: bool
    def __init__(
        self,
        name: str | None = None,
        robot_state: RobotState | None = None,
        robot_model_name: str | None = None,
        fixed_frame_transforms: _Collection[_geometry_msgs_msg.TransformStamped] | None = None,
        allowed_collision_matrix: AllowedCollisionMatrix | None = None,
        link_padding: _Collection[LinkPadding] | None = None,
        link_scale: _Collection[LinkScale] | None = None,
        object_colors: _Collection[ObjectColor] | None = None,
        world: PlanningSceneWorld | None = None,
        is_diff: bool | None = None,
    ) -> None: ...

class PlanningSceneWorld(_Ros2Message):
    collision_objects: list[CollisionObject]
    octomap: _octomap_msgs_msg.OctomapWithPose
    def __init__(
        self,
        collision_objects: _Collection[CollisionObject] | None = None,
        octomap: _octomap_msgs_msg.OctomapWithPose | None = None,
    ) -> None: ...

class PositionConstraint(_Ros2Message):
    header: _std_msgs_msg.Header
    link_name: str
    target_point_offset: _geometry_msgs_msg.Vector3
    constraint_region: BoundingVolume
    weight: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        link_name: str | None = None,
        target_point_offset: _geometry_msgs_msg.Vector3 | None = None,
        constraint_region: BoundingVolume | None = None,
        weight: float | None = None,
    ) -> None: ...

class PositionIKRequest(_Ros2Message):
    group_name: str
    robot_state: RobotState
    constraints: Constraints
    avoid_collisions: bool
    ik_link_name: str
    pose_stamped: _geometry_msgs_msg.PoseStamped
    ik_link_names: list[str]
    pose_stamped_vector: list[_geometry_msgs_msg.PoseStamped]
    timeout: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        group_name: str | None = None,
        robot_state: RobotState | None = None,
        constraints: Constraints | None = None,
        avoid_collisions: bool | None = None,
        ik_link_name: str | None = None,
        pose_stamped: _geometry_msgs_msg.PoseStamped | None = None,
        ik_link_names: _Collection[str] | None = None,
        pose_stamped_vector: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
        timeout: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class RobotState(_Ros2Message):
    joint_state: _sensor_msgs_msg.JointState
    multi_dof_joint_state: _sensor_msgs_msg.MultiDOFJointState
    attached_collision_objects: list[AttachedCollisionObject]
    is_diff: bool
    def __init__(
        self,
        joint_state: _sensor_msgs_msg.JointState | None = None,
        multi_dof_joint_state: _sensor_msgs_msg.MultiDOFJointState | None = None,
        attached_collision_objects: _Collection[AttachedCollisionObject] | None = None,
        is_diff: bool | None = None,
    ) -> None: ...

class RobotTrajectory(_Ros2Message):
    joint_trajectory: _trajectory_msgs_msg.JointTrajectory
    multi_dof_joint_trajectory: _trajectory_msgs_msg.MultiDOFJointTrajectory
    def __init__(
        self,
        joint_trajectory: _trajectory_msgs_msg.JointTrajectory | None = None,
        multi_dof_joint_trajectory: _trajectory_msgs_msg.MultiDOFJointTrajectory | None = None,
    ) -> None: ...

class TrajectoryConstraints(_Ros2Message):
    constraints: list[Constraints]
    def __init__(
        self,
        constraints: _Collection[Constraints] | None = None,
    ) -> None: ...

class VisibilityConstraint(_Ros2Message):
    SENSOR_Z: _Final = 0
    SENSOR_Y: _Final = 1
    SENSOR_X: _Final = 2
    target_radius: float
    target_pose: _geometry_msgs_msg.PoseStamped
    cone_sides: int
    sensor_pose: _geometry_msgs_msg.PoseStamped
    max_view_angle: float
    max_range_angle: float
    sensor_view_direction: int
    weight: float
    def __init__(
        self,
        target_radius: float | None = None,
        target_pose: _geometry_msgs_msg.PoseStamped | None = None,
        cone_sides: int | None = None,
        sensor_pose: _geometry_msgs_msg.PoseStamped | None = None,
        max_view_angle: float | None = None,
        max_range_angle: float | None = None,
        sensor_view_direction: int | None = None,
        weight: float | None = None,
    ) -> None: ...

class WorkspaceParameters(_Ros2Message):
    header: _std_msgs_msg.Header
    min_corner: _geometry_msgs_msg.Vector3
    max_corner: _geometry_msgs_msg.Vector3
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        min_corner: _geometry_msgs_msg.Vector3 | None = None,
        max_corner: _geometry_msgs_msg.Vector3 | None = None,
    ) -> None: ...
