# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class Goals(_Ros2Message):
    header: _std_msgs_msg.Header
    goals: list[_geometry_msgs_msg.PoseStamped]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goals: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
    ) -> None: ...

class GridCells(_Ros2Message):
    header: _std_msgs_msg.Header
    cell_width: float
    cell_height: float
    cells: list[_geometry_msgs_msg.Point]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        cell_width: float | None = None,
        cell_height: float | None = None,
        cells: _Collection[_geometry_msgs_msg.Point] | None = None,
    ) -> None: ...

class MapMetaData(_Ros2Message):
    map_load_time: _builtin_interfaces_msg.Time
    resolution: float
    width: int
    height: int
    origin: _geometry_msgs_msg.Pose
    def __init__(
        self,
        map_load_time: _builtin_interfaces_msg.Time | _Time | float | None = None,
        resolution: float | None = None,
        width: int | None = None,
        height: int | None = None,
        origin: _geometry_msgs_msg.Pose | None = None,
    ) -> None: ...

class OccupancyGrid(_Ros2Message):
    header: _std_msgs_msg.Header
    info: MapMetaData
    data: list[int]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        info: MapMetaData | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Odometry(_Ros2Message):
    header: _std_msgs_msg.Header
    child_frame_id: str
    pose: _geometry_msgs_msg.PoseWithCovariance
    twist: _geometry_msgs_msg.TwistWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        child_frame_id: str | None = None,
        pose: _geometry_msgs_msg.PoseWithCovariance | None = None,
        twist: _geometry_msgs_msg.TwistWithCovariance | None = None,
    ) -> None: ...

class Path(_Ros2Message):
    header: _std_msgs_msg.Header
    poses: list[_geometry_msgs_msg.PoseStamped]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        poses: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
    ) -> None: ...
