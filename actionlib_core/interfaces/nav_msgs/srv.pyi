# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, Final as _Final
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.nav_msgs.msg as _nav_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class GetMap(_ServiceType):
    _request_class: _ClassVar[type[GetMapRequest]]
    _response_class: _ClassVar[type[GetMapResponse]]

class GetMapRequest(_Message):
    def __init__(self) -> None: ...

class GetMapResponse(_Message):
    map: _nav_msgs_msg.OccupancyGrid
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
    ) -> None: ...

class GetPlan(_ServiceType):
    _request_class: _ClassVar[type[GetPlanRequest]]
    _response_class: _ClassVar[type[GetPlanResponse]]

class GetPlanRequest(_Message):
    start: _geometry_msgs_msg.PoseStamped  # The pose to plan from; the header's stamp is not used.
    goal: _geometry_msgs_msg.PoseStamped  # The pose to plan to.
    tolerance: float  # Where the goal cannot be reached, the plan may end this far from it [m].
    def __init__(
        self,
        start: _geometry_msgs_msg.PoseStamped | None = None,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        tolerance: float | None = None,
    ) -> None: ...

class GetPlanResponse(_Message):
    plan: _nav_msgs_msg.Path  # empty when there is none
    def __init__(
        self,
        plan: _nav_msgs_msg.Path | None = None,
    ) -> None: ...

class LoadMap(_ServiceType):
    _request_class: _ClassVar[type[LoadMapRequest]]
    _response_class: _ClassVar[type[LoadMapResponse]]

class LoadMapRequest(_Message):
    map_url: str  # for example file:///maps/office.yaml
    def __init__(
        self,
        map_url: str | None = None,
    ) -> None: ...

class LoadMapResponse(_Message):
    RESULT_SUCCESS: _Final = 0  # Values of `result`.
    RESULT_MAP_DOES_NOT_EXIST: _Final = 1
    RESULT_INVALID_MAP_DATA: _Final = 2
    RESULT_INVALID_MAP_METADATA: _Final = 3
    RESULT_UNDEFINED_FAILURE: _Final = 255
    map: _nav_msgs_msg.OccupancyGrid  # valid only on success
    result: int
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
        result: int | None = None,
    ) -> None: ...

class SetMap(_ServiceType):
    _request_class: _ClassVar[type[SetMapRequest]]
    _response_class: _ClassVar[type[SetMapResponse]]

class SetMapRequest(_Message):
    map: _nav_msgs_msg.OccupancyGrid
    initial_pose: _geometry_msgs_msg.PoseWithCovarianceStamped
    def __init__(
        self,
        map: _nav_msgs_msg.OccupancyGrid | None = None,
        initial_pose: _geometry_msgs_msg.PoseWithCovarianceStamped | None = None,
    ) -> None: ...

class SetMapResponse(_Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...
