# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class GeoPoint(_Ros2Message):
    latitude: float
    longitude: float
    altitude: float
    def __init__(
        self,
        latitude: float | None = None,
        longitude: float | None = None,
        altitude: float | None = None,
    ) -> None: ...

class GeoPointStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    position: GeoPoint
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        position: GeoPoint | None = None,
    ) -> None: ...

class GeoPose(_Ros2Message):
    position: GeoPoint
    orientation: _geometry_msgs_msg.Quaternion
    def __init__(
        self,
        position: GeoPoint | None = None,
        orientation: _geometry_msgs_msg.Quaternion | None = None,
    ) -> None: ...

class GeoPoseStamped(_Ros2Message):
    header: _std_msgs_msg.Header
    pose: GeoPose
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: GeoPose | None = None,
    ) -> None: ...
