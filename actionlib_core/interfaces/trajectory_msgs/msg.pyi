# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration

class JointTrajectory(_Message):
    """Where joints shall be when; stamp 0 begins at once."""

    header: _std_msgs_msg.Header
    joint_names: list[str]
    points: list[JointTrajectoryPoint]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        points: _Collection[JointTrajectoryPoint] | None = None,
    ) -> None: ...

class JointTrajectoryPoint(_Message):
    """One point of a trajectory; each array is empty or has one element per joint."""

    positions: list[float]  # [rad] or [m]
    velocities: list[float]  # [rad/s] or [m/s]
    accelerations: list[float]  # [rad/s^2] or [m/s^2]
    effort: list[float]  # [Nm] or [N]
    time_from_start: _Duration  # since the trajectory's stamp
    def __init__(
        self,
        positions: _Collection[float] | None = None,
        velocities: _Collection[float] | None = None,
        accelerations: _Collection[float] | None = None,
        effort: _Collection[float] | None = None,
        time_from_start: _Duration | float | None = None,
    ) -> None: ...

class MultiDOFJointTrajectory(_Message):
    """As JointTrajectory, for joints with several degrees of freedom."""

    header: _std_msgs_msg.Header
    joint_names: list[str]
    points: list[MultiDOFJointTrajectoryPoint]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        joint_names: _Collection[str] | None = None,
        points: _Collection[MultiDOFJointTrajectoryPoint] | None = None,
    ) -> None: ...

class MultiDOFJointTrajectoryPoint(_Message):
    transforms: list[_geometry_msgs_msg.Transform]
    velocities: list[_geometry_msgs_msg.Twist]
    accelerations: list[_geometry_msgs_msg.Twist]
    time_from_start: _Duration
    def __init__(
        self,
        transforms: _Collection[_geometry_msgs_msg.Transform] | None = None,
        velocities: _Collection[_geometry_msgs_msg.Twist] | None = None,
        accelerations: _Collection[_geometry_msgs_msg.Twist] | None = None,
        time_from_start: _Duration | float | None = None,
    ) -> None: ...
