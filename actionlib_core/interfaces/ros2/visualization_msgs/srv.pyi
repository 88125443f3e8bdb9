# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.visualization_msgs.msg as _visualization_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class GetInteractiveMarkers(_Ros2Service):
    Request: _TypeAlias = GetInteractiveMarkers_Request
    Response: _TypeAlias = GetInteractiveMarkers_Response
    _request_class: _ClassVar[type[GetInteractiveMarkers_Request]]
    _response_class: _ClassVar[type[GetInteractiveMarkers_Response]]

class GetInteractiveMarkers_Request(_Ros2Message):
    def __init__(self) -> None: ...

class GetInteractiveMarkers_Response(_Ros2Message):
    sequence_number: int
    markers: list[_visualization_msgs_msg.InteractiveMarker]
    def __init__(
        self,
        sequence_number: int | None = None,
        markers: _Collection[_visualization_msgs_msg.InteractiveMarker] | None = None,
    ) -> None: ...
