# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class FrameGraph(_Ros2Service):
    Request: _TypeAlias = FrameGraph_Request
    Response: _TypeAlias = FrameGraph_Response
    _request_class: _ClassVar[type[FrameGraph_Request]]
    _response_class: _ClassVar[type[FrameGraph_Response]]

class FrameGraph_Request(_Ros2Message):
    def __init__(self) -> None: ...

class FrameGraph_Response(_Ros2Message):
    frame_yaml: str
    def __init__(
        self,
        frame_yaml: str | None = None,
    ) -> None: ...
