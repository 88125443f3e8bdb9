# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class SetCameraInfo(_Ros2Service):
    Request: _TypeAlias = SetCameraInfo_Request
    Response: _TypeAlias = SetCameraInfo_Response
    _request_class: _ClassVar[type[SetCameraInfo_Request]]
    _response_class: _ClassVar[type[SetCameraInfo_Response]]

class SetCameraInfo_Request(_Ros2Message):
    camera_info: _sensor_msgs_msg.CameraInfo
    def __init__(
        self,
        camera_info: _sensor_msgs_msg.CameraInfo | None = None,
    ) -> None: ...

class SetCameraInfo_Response(_Ros2Message):
    success: bool
    status_message: str
    def __init__(
        self,
        success: bool | None = None,
        status_message: str | None = None,
    ) -> None: ...
