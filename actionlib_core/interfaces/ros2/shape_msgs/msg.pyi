# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class Mesh(_Ros2Message):
    triangles: list[MeshTriangle]
    vertices: list[_geometry_msgs_msg.Point]
    def __init__(
        self,
        triangles: _Collection[MeshTriangle] | None = None,
        vertices: _Collection[_geometry_msgs_msg.Point] | None = None,
    ) -> None: ...

class MeshTriangle(_Ros2Message):
    vertex_indices: list[int]
    def __init__(
        self,
        vertex_indices: _Collection[int] | None = None,
    ) -> None: ...

class Plane(_Ros2Message):
    coef: list[float]
    def __init__(
        self,
        coef: _Collection[float] | None = None,
    ) -> None: ...

class SolidPrimitive(_Ros2Message):
    BOX: _Final = 1
    SPHERE: _Final = 2
    CYLINDER: _Final = 3
    CONE: _Final = 4
    PRISM: _Final = 5
    BOX_X: _Final = 0
    BOX_Y: _Final = 1
    BOX_Z: _Final = 2
    SPHERE_RADIUS: _Final = 0
    CYLINDER_HEIGHT: _Final = 0
    CYLINDER_RADIUS: _Final = 1
    CONE_HEIGHT: _Final = 0
    CONE_RADIUS: _Final = 1
    PRISM_HEIGHT: _Final = 0
    type: int
    dimensions: list[float]
    polygon: _geometry_msgs_msg.Polygon
    def __init__(
        self,
        type: int | None = None,
        dimensions: _Collection[float] | None = None,
        polygon: _geometry_msgs_msg.Polygon | None = None,
    ) -> None: ...
