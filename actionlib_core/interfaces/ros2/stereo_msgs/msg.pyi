# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class DisparityImage(_Ros2Message):
    header: _std_msgs_msg.Header
    image: _sensor_msgs_msg.Image
    f: float
    t: float
    valid_window: _sensor_msgs_msg.RegionOfInterest
    min_disparity: float
    max_disparity: float
    delta_d: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        image: _sensor_msgs_msg.Image | None = None,
        f: float | None = None,
        t: float | None = None,
        valid_window: _sensor_msgs_msg.RegionOfInterest | None = None,
        min_disparity: float | None = None,
        max_disparity: float | None = None,
        delta_d: float | None = None,
    ) -> None: ...
