# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar
import actionlib_core.interfaces.sensor_msgs.msg as _sensor_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class SetCameraInfo(_ServiceType):
    _request_class: _ClassVar[type[SetCameraInfoRequest]]
    _response_class: _ClassVar[type[SetCameraInfoResponse]]

class SetCameraInfoRequest(_Message):
    camera_info: _sensor_msgs_msg.CameraInfo
    def __init__(
        self,
        camera_info: _sensor_msgs_msg.CameraInfo | None = None,
    ) -> None: ...

class SetCameraInfoResponse(_Message):
    success: bool  # whether the calibration was stored
    status_message: str  # why, or why not
    def __init__(
        self,
        success: bool | None = None,
        status_message: str | None = None,
    ) -> None: ...
