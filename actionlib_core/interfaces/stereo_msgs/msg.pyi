# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class DisparityImage(_Message):
    """Disparities of a stereo pair."""

    header: _std_msgs_msg.Header
    image: _sensor_msgs_msg.Image  # 32FC1 [pixel]
    f: float  # focal length [pixel]
    T: float  # baseline [m]
    valid_window: _sensor_msgs_msg.RegionOfInterest
    min_disparity: float  # [pixel]
    max_disparity: float  # [pixel]
    delta_d: float  # smallest step [pixel]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        image: _sensor_msgs_msg.Image | None = None,
        f: float | None = None,
        T: float | None = None,
        valid_window: _sensor_msgs_msg.RegionOfInterest | None = None,
        min_disparity: float | None = None,
        max_disparity: float | None = None,
        delta_d: float | None = None,
    ) -> None: ...
