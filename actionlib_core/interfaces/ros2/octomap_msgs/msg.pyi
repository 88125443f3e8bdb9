# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class Octomap(_Ros2Message):
    header: _std_msgs_msg.Header
    binary: bool
    id: str
    resolution: float
    data: list[int]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        binary: bool | None = None,
        id: str | None = None,
        resolution: float | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class OctomapWithPose(_Ros2Message):
    header: _std_msgs_msg.Header
    origin: _geometry_msgs_msg.Pose
    octomap: Octomap
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        origin: _geometry_msgs_msg.Pose | None = None,
        octomap: Octomap | None = None,
    ) -> None: ...
