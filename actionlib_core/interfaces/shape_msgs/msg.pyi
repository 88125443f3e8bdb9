# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
from actionlib_core.interfaces import Message as _Message

class Mesh(_Message):
    """A surface of triangles."""

    triangles: list[MeshTriangle]
    vertices: list[_geometry_msgs_msg.Point]  # [m]
    def __init__(
        self,
        triangles: _Collection[MeshTriangle] | None = None,
        vertices: _Collection[_geometry_msgs_msg.Point] | None = None,
    ) -> None: ...

class MeshTriangle(_Message):
    vertex_indices: list[int]  # into the mesh's vertices
    def __init__(
        self,
        vertex_indices: _Collection[int] | None = None,
    ) -> None: ...

class Plane(_Message):
    """The plane a x + b y + c z + d = 0."""

    coef: list[float]  # a, b, c, d
    def __init__(
        self,
        coef: _Collection[float] | None = None,
    ) -> None: ...

class SolidPrimitive(_Message):
    """A simple body."""

    BOX: _Final = 1
    SPHERE: _Final = 2
    CYLINDER: _Final = 3
    CONE: _Final = 4
    BOX_X: _Final = 0
    BOX_Y: _Final = 1
    BOX_Z: _Final = 2
    SPHERE_RADIUS: _Final = 0
    CYLINDER_HEIGHT: _Final = 0
    CYLINDER_RADIUS: _Final = 1
    CONE_HEIGHT: _Final = 0
    CONE_RADIUS: _Final = 1
    type: int  # BOX, SPHERE, CYLINDER or CONE
    dimensions: list[float]  # [m], indexed by the constants of its type
    def __init__(
        self,
        type: int | None = None,
        dimensions: _Collection[float] | None = None,
    ) -> None: ...
