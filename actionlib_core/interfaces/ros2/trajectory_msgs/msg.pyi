# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration

class JointTrajectory(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    points: list[JointTrajectoryPoint]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        points: _Collection[JointTrajectoryPoint] | None = None,
    ) -> None: ...

class JointTrajectoryPoint(_Ros2Message):
    positions: list[float]
    velocities: list[float]
    accelerations: list[float]
    effort: list[float]
    time_from_start: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        positions: _Collection[float] | None = None,
        velocities: _Collection[float] | None = None,
        accelerations: _Collection[float] | None = None,
        effort: _Collection[float] | None = None,
        time_from_start: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...

class MultiDOFJointTrajectory(_Ros2Message):
    header: _std_msgs_msg.Header
    joint_names: list[str]
    points: list[MultiDOFJointTrajectoryPoint]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        points: _Collection[MultiDOFJointTrajectoryPoint] | None = None,
    ) -> None: ...

class MultiDOFJointTrajectoryPoint(_Ros2Message):
    transforms: list[_geometry_msgs_msg.Transform]
    velocities: list[_geometry_msgs_msg.Twist]
    accelerations: list[_geometry_msgs_msg.Twist]
    time_from_start: _builtin_interfaces_msg.Duration
    def __init__(
        self,
        transforms: _Collection[_geometry_msgs_msg.Transform] | None = None,
        velocities: _Collection[_geometry_msgs_msg.Twist] | None = None,
        accelerations: _Collection[_geometry_msgs_msg.Twist] | None = None,
        time_from_start: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
    ) -> None: ...
