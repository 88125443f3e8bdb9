# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
import actionlib_core.interfaces.ros2.trajectory_msgs.msg as _trajectory_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration

class AdmittanceControllerState(_Ros2Message):
    mass: _std_msgs_msg.Float64MultiArray
    damping: _std_msgs_msg.Float64MultiArray
    stiffness: _std_msgs_msg.Float64MultiArray
    rot_base_control: _geometry_msgs_msg.Quaternion
    ref_trans_base_ft: _geometry_msgs_msg.TransformStamped
    selected_axes: _std_msgs_msg.Int8MultiArray
    ft_sensor_frame: _std_msgs_msg.String
    admittance_position: _geometry_msgs_msg.TransformStamped
    admittance_acceleration: _geometry_msgs_msg.TwistStamped
    admittance_velocity: _geometry_msgs_msg.TwistStamped
    wrench_base: _geometry_msgs_msg.WrenchStamped
    joint_state: _sensor_msgs_msg.JointState
    def __init__(
        self,
        mass: _std_msgs_msg.Float64MultiArray | None = None,
        damping: _std_msgs_msg.Float64MultiArray | None = None,
        stiffness: _std_msgs_msg.Float64MultiArray | None = None,
        rot_base_control: _geometry_msgs_msg.Quaternion | None = None,
        ref_trans_base_ft: _geometry_msgs_msg.TransformStamped | None = None,
        selected_axes: _std_msgs_msg.Int8MultiArray | None = None,
        ft_sensor_frame: _std_msgs_msg.String | None = None,
        admittance_position: _geometry_msgs_msg.TransformStamped | None = None,
        admittance_acceleration: _geometry_msgs_msg.TwistStamped | None = None,
        admittance_velocity: _geometry_msgs_msg.TwistStamped | None = None,
        wrench_base: _geometry_msgs_msg.WrenchStamped | None = None,
        joint_state: _sensor_msgs_msg.JointState | None = None,
    ) -> None: ...

class BatteryStateArray(_Ros2Message):
    battery_states: list[_sensor_msgs_msg.BatteryState]
    def __init__(
        self,
        battery_states: _Collection[_sensor_msgs_msg.BatteryState] | None = None,
    ) -> None: ...

class DynamicInterfaceGroupValues(_Ros2Message):
    header: _std_msgs_msg.Header
    interface_groups: list[str]
    interface_values: list[InterfaceValue]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        interface_groups: _Collection[str] | None = None,
        interface_values: _Collection[InterfaceValue] | None = None,
    ) -> None: ...

class DynamicInterfaceValues(_Ros2Message):
    header: _std_msgs_msg.Header
    states: InterfaceValue
    commands: InterfaceValue
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        states: InterfaceValue | None = None,
        commands: InterfaceValue | None = None,
    ) -> None: ...

class DynamicJointState(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    interface_values: list[InterfaceValue]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        interface_values: _Collection[InterfaceValue] | None = None,
    ) -> None: ...

class Float64Values(_Ros2Message):
    header: _std_msgs_msg.Header
    values: list[float]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        values: _Collection[float] | None = None,
    ) -> None: ...

class GripperCommand(_Ros2Message):
    position: float
    max_effort: float
    def __init__(
        self,
        position: float | None = None,
        max_effort: float | None = None,
    ) -> None: ...

class InterfaceValue(_Ros2Message):
    interface_names: list[str]
    values: list[float]
    def __init__(
        self,
        interface_names: _Collection[str] | None = None,
        values: _Collection[float] | None = None,
    ) -> None: ...

class JointComponentTolerance(_Ros2Message):
    X_AXIS: _Final = 1
    Y_AXIS: _Final = 2
    Z_AXIS: _Final = 3
    TRANSLATION: _Final = 4
    ROTATION: _Final = 5
    joint_name: str
    component: int
    position: float
    velocity: float
    acceleration: float
    def __init__(
        self,
        joint_name: str | None = None,
        component: int | None = None,
        position: float | None = None,
        velocity: float | None = None,
        acceleration: float | None = None,
    ) -> None: ...

class JointControllerState(_Ros2Message):
    header: _std_msgs_msg.Header
    set_point: float
    process_value: float
    process_value_dot: float
    error: float
    time_step: float
    command: float
    p: float
    i: float
    d: float
    i_clamp: float
    antiwindup: bool
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        set_point: float | None = None,
        process_value: float | None = None,
        process_value_dot: float | None = None,
        error: float | None = None,
        time_step: float | None = None,
        command: float | None = None,
        p: float | None = None,
        i: float | None = None,
        d: float | None = None,
        i_clamp: float | None = None,
        antiwindup: bool | None = None,
    ) -> None: ...

class JointJog(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    displacements: list[float]
    velocities: list[float]
    duration: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        displacements: _Collection[float] | None = None,
        velocities: _Collection[float] | None = None,
        duration: float | None = None,
    ) -> None: ...

class JointTolerance(_Ros2Message):
    name: str
    position: float
    velocity: float
    acceleration: float
    def __init__(
        self,
        name: str | None = None,
        position: float | None = None,
        velocity: float | None = None,
        acceleration: float | None = None,
    ) -> None: ...

class JointTrajectoryControllerState(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    reference: _trajectory_msgs_msg.JointTrajectoryPoint
    feedback: _trajectory_msgs_msg.JointTrajectoryPoint
    error: _trajectory_msgs_msg.JointTrajectoryPoint
    output: _trajectory_msgs_msg.JointTrajectoryPoint
    multi_dof_joint_names: list[str]
    multi_dof_reference: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    multi_dof_feedback: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    multi_dof_error: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    multi_dof_output: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint
    speed_scaling_factor: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        reference: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        feedback: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        error: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        output: _trajectory_msgs_msg.JointTrajectoryPoint | None = None,
        multi_dof_joint_names: _Collection[str] | None = None,
        multi_dof_reference: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        multi_dof_feedback: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        multi_dof_error: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        multi_dof_output: _trajectory_msgs_msg.MultiDOFJointTrajectoryPoint | None = None,
        speed_scaling_factor: float | None = None,
    ) -> None: ...

class Keys(_Ros2Message):
    header: _std_msgs_msg.Header
    keys: list[str]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        keys: _Collection[str] | None = None,
    ) -> None: ...

class MecanumDriveControllerState(_Ros2Message):
    header: _std_msgs_msg.Header
    front_left_wheel_velocity: float
    back_left_wheel_velocity: float
    back_right_wheel_velocity: float
    front_right_wheel_velocity: float
    reference_velocity: _geometry_msgs_msg.Twist
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        front_left_wheel_velocity: float | None = None,
        back_left_wheel_velocity: float | None = None,
        back_right_wheel_velocity: float | None = None,
        front_right_wheel_velocity: float | None = None,
        reference_velocity: _geometry_msgs_msg.Twist | None = None,
    ) -> None: ...

class MotionArgument(_Ros2Message):
    name: str
    value: float
    def __init__(
        self,
        name: str | None = None,
        value: float | None = None,
    ) -> None: ...

class MotionPrimitive(_Ros2Message):
    UNKNOWN: _Final = -1
    LINEAR_JOINT: _Final = 0
    LINEAR_CARTESIAN: _Final = 50
    CIRCULAR_CARTESIAN: _Final = 51
    type: int
    blend_radius: float
    additional_arguments: list[MotionArgument]
    poses: list[_geometry_msgs_msg.PoseStamped]
    joint_positions: list[float]
    def __init__(
        self,
        type: int | None = None,
        blend_radius: float | None = None,
        additional_arguments: _Collection[MotionArgument] | None = None,
        poses: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
        joint_positions: _Collection[float] | None = None,
    ) -> None: ...

class MotionPrimitiveSequence(_Ros2Message):
    motions: list[MotionPrimitive]
    def __init__(
        self,
        motions: _Collection[MotionPrimitive] | None = None,
    ) -> None: ...

class MultiDOFCommand(_Ros2Message):
    dof_names: list[str]
    values: list[float]
    values_dot: list[float]
    def __init__(
        self,
        dof_names: _Collection[str] | None = None,
        values: _Collection[float] | None = None,
        values_dot: _Collection[float] | None = None,
    ) -> None: ...

class MultiDOFStateStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    dof_states: list[SingleDOFState]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        dof_states: _Collection[SingleDOFState] | None = None,
    ) -> None: ...

class PidState(_Ros2Message):
    header: _std_msgs_msg.Header
    timestep: _builtin_interfaces_msg.Duration
    error: float
    error_dot: float
    p_error: float
    i_error: float
    d_error: float
    p_term: float
    i_term: float
    d_term: float
    i_max: float
    i_min: float
    output: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        timestep: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        error: float | None = None,
        error_dot: float | None = None,
        p_error: float | None = None,
        i_error: float | None = None,
        d_error: float | None = None,
        p_term: float | None = None,
        i_term: float | None = None,
        d_term: float | None = None,
        i_max: float | None = None,
        i_min: float | None = None,
        output: float | None = None,
    ) -> None: ...

class SingleDOFState(_Ros2Message):
    name: str
    reference: float
    feedback: float
    feedback_dot: float
    error: float
    error_dot: float
    time_step: float
    output: float
    def __init__(
        self,
        name: str | None = None,
        reference: float | None = None,
        feedback: float | None = None,
        feedback_dot: float | None = None,
        error: float | None = None,
        error_dot: float | None = None,
        time_step: float | None = None,
        output: float | None = None,
    ) -> None: ...

class SingleDOFStateStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    dof_state: SingleDOFState
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        dof_state: SingleDOFState | None = None,
    ) -> None: ...

class SpeedScalingFactor(_Ros2Message):
    factor: float
    def __init__(
        self,
        factor: float | None = None,
    ) -> None: ...

class SteeringControllerStatus(_Ros2Message):
    header: _std_msgs_msg.Header
    traction_wheels_position: list[float]
    traction_wheels_velocity: list[float]
    steer_positions: list[float]
    linear_velocity_command: list[float]
    steering_angle_command: list[float]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        traction_wheels_position: _Collection[float] | None = None,
        traction_wheels_velocity: _Collection[float] | None = None,
        steer_positions: _Collection[float] | None = None,
        linear_velocity_command: _Collection[float] | None = None,
        steering_angle_command: _Collection[float] | None = None,
    ) -> None: ...

class VDA5050SafetyState(_Ros2Message):
    AUTO_ACK: _Final = 'autoAck'
    MANUAL: _Final = 'manual'
    REMOTE: _Final = 'remote'
    NONE: _Final = 'none'
    e_stop: str
    field_violation: bool
    def __init__(
        self,
        e_stop: str | None = None,
        field_violation: bool | None = None,
    ) -> None: ...
