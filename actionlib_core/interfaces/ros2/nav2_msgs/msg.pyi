# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class BehaviorTreeLog(_Ros2Message):
    timestamp: _builtin_interfaces_msg.Time
    event_log: list[BehaviorTreeStatusChange]
    def __init__(
        self,
        timestamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        event_log: _Collection[BehaviorTreeStatusChange] | None = None,
    ) -> None: ...

class BehaviorTreeStatusChange(_Ros2Message):
    timestamp: _builtin_interfaces_msg.Time
    node_name: str
    uid: int
    previous_status: str
    current_status: str
    def __init__(
        self,
        timestamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        node_name: str | None = None,
        uid: int | None = None,
        previous_status: str | None = None,
        current_status: str | None = None,
    ) -> None: ...

class CollisionDetectorState(_Ros2Message):
    polygons: list[str]
    detections: list[bool]
    def __init__(
        self,
        polygons: _Collection[str] | None = None,
        detections: _Collection[bool] | None = None,
    ) -> None: ...

class CollisionMonitorState(_Ros2Message):
    DO_NOTHING: _Final = 0
    STOP: _Final = 1
    SLOWDOWN: _Final = 2
    APPROACH: _Final = 3
    LIMIT: _Final = 4
    action_type: int
    polygon_name: str
    def __init__(
        self,
        action_type: int | None = None,
        polygon_name: str | None = None,
    ) -> None: ...

class Costmap(_Ros2Message):
    header: _std_msgs_msg.Header
    metadata: CostmapMetaData
    data: bytes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        metadata: CostmapMetaData | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class CostmapFilterInfo(_Ros2Message):
    header: _std_msgs_msg.Header
    type: int
    filter_mask_topic: str
    base: float
    multiplier: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        type: int | None = None,
        filter_mask_topic: str | None = None,
        base: float | None = None,
        multiplier: float | None = None,
    ) -> None: ...

class CostmapMetaData(_Ros2Message):
    map_load_time: _builtin_interfaces_msg.Time
    update_time: _builtin_interfaces_msg.Time
    layer: str
    resolution: float
    size_x: int
    size_y: int
    origin: _geometry_msgs_msg.Pose
    def __init__(
        self,
        map_load_time: _builtin_interfaces_msg.Time | _Time | float | None = None,
        update_time: _builtin_interfaces_msg.Time | _Time | float | None = None,
        layer: str | None = None,
        resolution: float | None = None,
        size_x: int | None = None,
        size_y: int | None = None,
        origin: _geometry_msgs_msg.Pose | None = None,
    ) -> None: ...

class CostmapUpdate(_Ros2Message):
    header: _std_msgs_msg.Header
    x: int
    y: int
    size_x: int
    size_y: int
    data: bytes
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        x: int | None = None,
        y: int | None = None,
        size_x: int | None = None,
        size_y: int | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class EdgeCost(_Ros2Message):
    edgeid: int
    cost: float
    def __init__(
        self,
        edgeid: int | None = None,
        cost: float | None = None,
    ) -> None: ...

class MissedWaypoint(_Ros2Message):
    index: int
    goal: _geometry_msgs_msg.PoseStamped
    error_code: int
    def __init__(
        self,
        index: int | None = None,
        goal: _geometry_msgs_msg.PoseStamped | None = None,
        error_code: int | None = None,
    ) -> None: ...

class Particle(_Ros2Message):
    pose: _geometry_msgs_msg.Pose
    weight: float
    def __init__(
        self,
        pose: _geometry_msgs_msg.Pose | None = None,
        weight: float | None = None,
    ) -> None: ...

class ParticleCloud(_Ros2Message):
    header: _std_msgs_msg.Header
    particles: list[Particle]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        particles: _Collection[Particle] | None = None,
    ) -> None: ...

class Route(_Ros2Message):
    header: _std_msgs_msg.Header
    route_cost: float
    nodes: list[RouteNode]
    edges: list[RouteEdge]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        route_cost: float | None = None,
        nodes: _Collection[RouteNode] | None = None,
        edges: _Collection[RouteEdge] | None = None,
    ) -> None: ...

class RouteEdge(_Ros2Message):
    edgeid: int
    start: _geometry_msgs_msg.Point
    end: _geometry_msgs_msg.Point
    def __init__(
        self,
        edgeid: int | None = None,
        start: _geometry_msgs_msg.Point | None = None,
        end: _geometry_msgs_msg.Point | None = None,
    ) -> None: ...

class RouteNode(_Ros2Message):
    nodeid: int
    position: _geometry_msgs_msg.Point
    def __init__(
        self,
        nodeid: int | None = None,
        position: _geometry_msgs_msg.Point | None = None,
    ) -> None: ...

class SpeedLimit(_Ros2Message):
    header: _std_msgs_msg.Header
    percentage: bool
    speed_limit: float
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        percentage: bool | None = None,
        speed_limit: float | None = None,
    ) -> None: ...

class VoxelGrid(_Ros2Message):
    header: _std_msgs_msg.Header
    data: list[int]
    origin: _geometry_msgs_msg.Point32
    resolutions: _geometry_msgs_msg.Vector3
    size_x: int
    size_y: int
    size_z: int
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        data: _Collection[int] | None = None,
        origin: _geometry_msgs_msg.Point32 | None = None,
        resolutions: _geometry_msgs_msg.Vector3 | None = None,
        size_x: int | None = None,
        size_y: int | None = None,
        size_z: int | None = None,
    ) -> None: ...
