# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.nav_msgs.msg as _nav_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class GetMap(_Ros2Service):
    Request: _TypeAlias = GetMap_Request
    Response: _TypeAlias = GetMap_Response
    _request_class: _ClassVar[type[GetMap_Request]]
    _response_class: _ClassVar[type[GetMap_Response]]

class GetMap_Request(_Ros2Message):
    def __init__(self) -> None: ...

class GetMap_Response(_Ros2Message):
    map: _nav_msgs_msg.OccupancyGrid
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
    ) -> None: ...

class GetPlan(_Ros2Service):
    Request: _TypeAlias = GetPlan_Request
    Response: _TypeAlias = GetPlan_Response
    _request_class: _ClassVar[type[GetPlan_Request]]
    _response_class: _ClassVar[type[GetPlan_Response]]

class GetPlan_Request(_Ros2Message):
    start: _geometry_msgs_msg.PoseStamped
    goal: _geometry_msgs_msg.PoseStamped
    tolerance: float
    def __init__(
        self,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        tolerance: float | None = None,
    ) -> None: ...

class GetPlan_Response(_Ros2Message):
    plan: _nav_msgs_msg.Path
    def __init__(
        self,
        plan: _nav_msgs_msg.Path | None = None,
    ) -> None: ...

class LoadMap(_Ros2Service):
    Request: _TypeAlias = LoadMap_Request
    Response: _TypeAlias = LoadMap_Response
    _request_class: _ClassVar[type[LoadMap_Request]]
    _response_class: _ClassVar[type[LoadMap_Response]]

class LoadMap_Request(_Ros2Message):
    map_url: str
    def __init__(
        self,
        map_url: str | None = None,
    ) -> None: ...

class LoadMap_Response(_Ros2Message):
    RESULT_SUCCESS: _Final = 0
    RESULT_MAP_DOES_NOT_EXIST: _Final = 1
    RESULT_INVALID_MAP_DATA: _Final = 2
    RESULT_INVALID_MAP_METADATA: _Final = 3
    RESULT_UNDEFINED_FAILURE: _Final = 255
    map: _nav_msgs_msg.OccupancyGrid
    result: int
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
        result: int | None = None,
    ) -> None: ...

class SetMap(_Ros2Service):
    Request: _TypeAlias = SetMap_Request
    Response: _TypeAlias = SetMap_Response
    _request_class: _ClassVar[type[SetMap_Request]]
    _response_class: _ClassVar[type[SetMap_Response]]

class SetMap_Request(_Ros2Message):
    map: _nav_msgs_msg.OccupancyGrid
    initial_pose: _geometry_msgs_msg.PoseWithCovarianceStamped
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
        initial_pose: _geometry_msgs_msg.PoseWithCovarianceStamped | None = None,
    ) -> None: ...

class SetMap_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...
