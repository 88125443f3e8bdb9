# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class TF2Error(_Ros2Message):
    NO_ERROR: _Final = 0
    LOOKUP_ERROR: _Final = 1
    CONNECTIVITY_ERROR: _Final = 2
    EXTRAPOLATION_ERROR: _Final = 3
    INVALID_ARGUMENT_ERROR: _Final = 4
    TIMEOUT_ERROR: _Final = 5
    TRANSFORM_ERROR: _Final = 6
    error: int
    error_string: str
    def __init__(
        self,
        error: int | None = None,
        error_string: str | None = None,
    ) -> None: ...

class TFMessage(_Ros2Message):
    transforms: list[_geometry_msgs_msg.TransformStamped]
    def __init__(
        self,
        transforms: _Collection[_geometry_msgs_msg.TransformStamped] | None = None,
    ) -> None: ...
