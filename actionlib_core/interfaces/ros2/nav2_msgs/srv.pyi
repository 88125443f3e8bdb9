# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.nav2_msgs.msg as _nav2_msgs_msg
import actionlib_core.interfaces.ros2.nav_msgs.msg as _nav_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class ClearCostmapAroundPose(_Ros2Service):
    Request: _TypeAlias = ClearCostmapAroundPose_Request
    Response: _TypeAlias = ClearCostmapAroundPose_Response
    _request_class: _ClassVar[type[ClearCostmapAroundPose_Request]]
    _response_class: _ClassVar[type[ClearCostmapAroundPose_Response]]

class ClearCostmapAroundPose_Request(_Ros2Message):
    pose: _geometry_msgs_msg.PoseStamped
    reset_distance: float
    def __init__(
        self,
        pose: _geometry_msgs_msg.PoseStamped | None = None,
        reset_distance: float | None = None,
    ) -> None: ...

class ClearCostmapAroundPose_Response(_Ros2Message):
    response: _std_msgs_msg.Empty
    def __init__(
        self,
        response: _std_msgs_msg.Empty | None = None,
    ) -> None: ...

class ClearCostmapAroundRobot(_Ros2Service):
    Request: _TypeAlias = ClearCostmapAroundRobot_Request
    Response: _TypeAlias = ClearCostmapAroundRobot_Response
    _request_class: _ClassVar[type[ClearCostmapAroundRobot_Request]]
    _response_class: _ClassVar[type[ClearCostmapAroundRobot_Response]]

class ClearCostmapAroundRobot_Request(_Ros2Message):
    reset_distance: float
    def __init__(
        self,
        reset_distance: float | None = None,
    ) -> None: ...

class ClearCostmapAroundRobot_Response(_Ros2Message):
    response: _std_msgs_msg.Empty
    def __init__(
        self,
        response: _std_msgs_msg.Empty | None = None,
    ) -> None: ...

class ClearCostmapExceptRegion(_Ros2Service):
    Request: _TypeAlias = ClearCostmapExceptRegion_Request
    Response: _TypeAlias = ClearCostmapExceptRegion_Response
    _request_class: _ClassVar[type[ClearCostmapExceptRegion_Request]]
    _response_class: _ClassVar[type[ClearCostmapExceptRegion_Response]]

class ClearCostmapExceptRegion_Request(_Ros2Message):
    reset_distance: float
    def __init__(
        self,
        reset_distance: float | None = None,
    ) -> None: ...

class ClearCostmapExceptRegion_Response(_Ros2Message):
    response: _std_msgs_msg.Empty
    def __init__(
        self,
        response: _std_msgs_msg.Empty | None = None,
    ) -> None: ...

class ClearEntireCostmap(_Ros2Service):
    Request: _TypeAlias = ClearEntireCostmap_Request
    Response: _TypeAlias = ClearEntireCostmap_Response
    _request_class: _ClassVar[type[ClearEntireCostmap_Request]]
    _response_class: _ClassVar[type[ClearEntireCostmap_Response]]

class ClearEntireCostmap_Request(_Ros2Message):
    request: _std_msgs_msg.Empty
    def __init__(
        self,
        request: _std_msgs_msg.Empty | None = None,
    ) -> None: ...

class ClearEntireCostmap_Response(_Ros2Message):
    response: _std_msgs_msg.Empty
    def __init__(
        self,
        response: _std_msgs_msg.Empty | None = None,
    ) -> None: ...

class DynamicEdges(_Ros2Service):
    Request: _TypeAlias = DynamicEdges_Request
    Response: _TypeAlias = DynamicEdges_Response
    _request_class: _ClassVar[type[DynamicEdges_Request]]
    _response_class: _ClassVar[type[DynamicEdges_Response]]

class DynamicEdges_Request(_Ros2Message):
    closed_edges: list[int]
    opened_edges: list[int]
    adjust_edges: list[_nav2_msgs_msg.EdgeCost]
    def __init__(
        self,
        closed_edges: _Collection[int] | None = None,
        opened_edges: _Collection[int] | None = None,
        adjust_edges: _Collection[_nav2_msgs_msg.EdgeCost] | None = None,
    ) -> None: ...

class DynamicEdges_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...

class GetCost(_Ros2Service):
    Request: _TypeAlias = GetCost_Request
    Response: _TypeAlias = GetCost_Response
    _request_class: _ClassVar[type[GetCost_Request]]
    _response_class: _ClassVar[type[GetCost_Response]]

class GetCost_Request(_Ros2Message):
    use_footprint: bool
    x: float
    y: float
    theta: float
    def __init__(
        self,
        use_footprint: bool | None = None,
        x: float | None = None,
        y: float | None = None,
        theta: float | None = None,
    ) -> None: ...

class GetCost_Response(_Ros2Message):
    cost: float
    def __init__(
        self,
        cost: float | None = None,
    ) -> None: ...

class GetCostmap(_Ros2Service):
    Request: _TypeAlias = GetCostmap_Request
    Response: _TypeAlias = GetCostmap_Response
    _request_class: _ClassVar[type[GetCostmap_Request]]
    _response_class: _ClassVar[type[GetCostmap_Response]]

class GetCostmap_Request(_Ros2Message):
    specs: _nav2_msgs_msg.CostmapMetaData
    def __init__(
        self,
        specs: _nav2_msgs_msg.CostmapMetaData | None = None,
    ) -> None: ...

class GetCostmap_Response(_Ros2Message):
    map: _nav2_msgs_msg.Costmap
    def __init__(
        self,
        map: _nav2_msgs_msg.Costmap | None = None,
    ) -> None: ...

class IsPathValid(_Ros2Service):
    Request: _TypeAlias = IsPathValid_Request
    Response: _TypeAlias = IsPathValid_Response
    _request_class: _ClassVar[type[IsPathValid_Request]]
    _response_class: _ClassVar[type[IsPathValid_Response]]

class IsPathValid_Request(_Ros2Message):
    path: _nav_msgs_msg.Path
    def __init__(
        self,
        path: _nav_msgs_msg.Path | None = None,
    ) -> None: ...

class IsPathValid_Response(_Ros2Message):
    is_valid: bool
    invalid_pose_indices: list[int]
    def __init__(
        self,
        is_valid: bool | None = None,
        invalid_pose_indices: _Collection[int] | None = None,
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

class ManageLifecycleNodes(_Ros2Service):
    Request: _TypeAlias = ManageLifecycleNodes_Request
    Response: _TypeAlias = ManageLifecycleNodes_Response
    _request_class: _ClassVar[type[ManageLifecycleNodes_Request]]
    _response_class: _ClassVar[type[ManageLifecycleNodes_Response]]

class ManageLifecycleNodes_Request(_Ros2Message):
    STARTUP: _Final = 0
    PAUSE: _Final = 1
    RESUME: _Final = 2
    RESET: _Final = 3
    SHUTDOWN: _Final = 4
    CONFIGURE: _Final = 5
    CLEANUP: _Final = 6
    command: int
    def __init__(
        self,
        command: int | None = None,
    ) -> None: ...

class ManageLifecycleNodes_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...

class ReloadDockDatabase(_Ros2Service):
    Request: _TypeAlias = ReloadDockDatabase_Request
    Response: _TypeAlias = ReloadDockDatabase_Response
    _request_class: _ClassVar[type[ReloadDockDatabase_Request]]
    _response_class: _ClassVar[type[ReloadDockDatabase_Response]]

class ReloadDockDatabase_Request(_Ros2Message):
    filepath: str
    def __init__(
        self,
        filepath: str | None = None,
    ) -> None: ...

class ReloadDockDatabase_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...

class SaveMap(_Ros2Service):
    Request: _TypeAlias = SaveMap_Request
    Response: _TypeAlias = SaveMap_Response
    _request_class: _ClassVar[type[SaveMap_Request]]
    _response_class: _ClassVar[type[SaveMap_Response]]

class SaveMap_Request(_Ros2Message):
    map_topic: str
    map_url: str
    image_format: str
    map_mode: str
    free_thresh: float
    occupied_thresh: float
    def __init__(
        self,
        map_topic: str | None = None,
        map_url: str | None = None,
        image_format: str | None = None,
        map_mode: str | None = None,
        free_thresh: float | None = None,
        occupied_thresh: float | None = None,
    ) -> None: ...

class SaveMap_Response(_Ros2Message):
    result: bool
    def __init__(
        self,
        result: bool | None = None,
    ) -> None: ...

class SetInitialPose(_Ros2Service):
    Request: _TypeAlias = SetInitialPose_Request
    Response: _TypeAlias = SetInitialPose_Response
    _request_class: _ClassVar[type[SetInitialPose_Request]]
    _response_class: _ClassVar[type[SetInitialPose_Response]]

class SetInitialPose_Request(_Ros2Message):
    pose: _geometry_msgs_msg.PoseWithCovarianceStamped
    def __init__(
        self,
        pose: _geometry_msgs_msg.PoseWithCovarianceStamped | None = None,
    ) -> None: ...

class SetInitialPose_Response(_Ros2Message):
    def __init__(self) -> None: ...

class SetRouteGraph(_Ros2Service):
    Request: _TypeAlias = SetRouteGraph_Request
    Response: _TypeAlias = SetRouteGraph_Response
    _request_class: _ClassVar[type[SetRouteGraph_Request]]
    _response_class: _ClassVar[type[SetRouteGraph_Response]]

class SetRouteGraph_Request(_Ros2Message):
    graph_filepath: str
    def __init__(
        self,
        graph_filepath: str | None = None,
    ) -> None: ...

class SetRouteGraph_Response(_Ros2Message):
    success: bool
    def __init__(
        self,
        success: bool | None = None,
    ) -> None: ...

class Toggle(_Ros2Service):
    Request: _TypeAlias = Toggle_Request
    Response: _TypeAlias = Toggle_Response
    _request_class: _ClassVar[type[Toggle_Request]]
    _response_class: _ClassVar[type[Toggle_Response]]

class Toggle_Request(_Ros2Message):
    enable: bool
    def __init__(
        self,
        enable: bool | None = None,
    ) -> None: ...

class Toggle_Response(_Ros2Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...
