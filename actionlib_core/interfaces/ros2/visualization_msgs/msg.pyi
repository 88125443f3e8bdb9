# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.sensor_msgs.msg as _sensor_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Duration as _Duration

class ImageMarker(_Ros2Message):
    CIRCLE: _Final = 0
    LINE_STRIP: _Final = 1
    LINE_LIST: _Final = 2
    POLYGON: _Final = 3
    POINTS: _Final = 4
    ADD: _Final = 0
    REMOVE: _Final = 1
    header: _std_msgs_msg.Header
    ns: str
    id: int
    type: int
    action: int
    position: _geometry_msgs_msg.Point
    scale: float
    outline_color: _std_msgs_msg.ColorRGBA
    filled: int
    fill_color: _std_msgs_msg.ColorRGBA
    lifetime: _builtin_interfaces_msg.Duration
    points: list[_geometry_msgs_msg.Point]
    outline_colors: list[_std_msgs_msg.ColorRGBA]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        ns: str | None = None,
        id: int | None = None,
        type: int | None = None,
        action: int | None = None,
        position: _geometry_msgs_msg.Point | None = None,
        scale: float | None = None,
        outline_color: _std_msgs_msg.ColorRGBA | None = None,
        filled: int | None = None,
        fill_color: _std_msgs_msg.ColorRGBA | None = None,
        lifetime: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        points: _Collection[_geometry_msgs_msg.Point] | None = None,
        outline_colors: _Collection[_std_msgs_msg.ColorRGBA] | None = None,
    ) -> None: ...

class InteractiveMarker(_Ros2Message):
    header: _std_msgs_msg.Header
    pose: _geometry_msgs_msg.Pose
    name: str
    description: str
    scale: float
    menu_entries: list[MenuEntry]
    controls: list[InteractiveMarkerControl]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: _geometry_msgs_msg.Pose | None = None,
        name: str | None = None,
        description: str | None = None,
        scale: float | None = None,
        menu_entries: _Collection[MenuEntry] | None = None,
        controls: _Collection[InteractiveMarkerControl] | None = None,
    ) -> None: ...

class InteractiveMarkerControl(_Ros2Message):
    INHERIT: _Final = 0
    FIXED: _Final = 1
    VIEW_FACING: _Final = 2
    NONE: _Final = 0
    MENU: _Final = 1
    BUTTON: _Final = 2
    MOVE_AXIS: _Final = 3
    MOVE_PLANE: _Final = 4
    ROTATE_AXIS: _Final = 5
    MOVE_ROTATE: _Final = 6
    MOVE_3D: _Final = 7
    ROTATE_3D: _Final = 8
    MOVE_ROTATE_3D: _Final = 9
    name: str
    orientation: _geometry_msgs_msg.Quaternion
    orientation_mode: int
    interaction_mode: int
    always_visible: bool
    markers: list[Marker]
    independent_marker_orientation: bool
    description: str
    def __init__(
        self,
        name: str | None = None,
        orientation: _geometry_msgs_msg.Quaternion | None = None,
        orientation_mode: int | None = None,
        interaction_mode: int | None = None,
        always_visible: bool | None = None,
        markers: _Collection[Marker] | None = None,
        independent_marker_orientation: bool | None = None,
        description: str | None = None,
    ) -> None: ...

class InteractiveMarkerFeedback(_Ros2Message):
    KEEP_ALIVE: _Final = 0
    POSE_UPDATE: _Final = 1
    MENU_SELECT: _Final = 2
    BUTTON_CLICK: _Final = 3
    MOUSE_DOWN: _Final = 4
    MOUSE_UP: _Final = 5
    header: _std_msgs_msg.Header
    client_id: str
    marker_name: str
    control_name: str
    event_type: int
    pose: _geometry_msgs_msg.Pose
    menu_entry_id: int
    mouse_point: _geometry_msgs_msg.Point
    mouse_point_valid: bool
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        client_id: str | None = None,
        marker_name: str | None = None,
        control_name: str | None = None,
        event_type: int | None = None,
        pose: _geometry_msgs_msg.Pose | None = None,
        menu_entry_id: int | None = None,
        mouse_point: _geometry_msgs_msg.Point | None = None,
        mouse_point_valid: bool | None = None,
    ) -> None: ...

class InteractiveMarkerInit(_Ros2Message):
    server_id: str
    seq_num: int
    markers: list[InteractiveMarker]
    def __init__(
        self,
        server_id: str | None = None,
        seq_num: int | None = None,
        markers: _Collection[InteractiveMarker] | None = None,
    ) -> None: ...

class InteractiveMarkerPose(_Ros2Message):
    header: _std_msgs_msg.Header
    pose: _geometry_msgs_msg.Pose
    name: str
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        pose: _geometry_msgs_msg.Pose | None = None,
        name: str | None = None,
    ) -> None: ...

class InteractiveMarkerUpdate(_Ros2Message):
    KEEP_ALIVE: _Final = 0
    UPDATE: _Final = 1
    server_id: str
    seq_num: int
    type: int
    markers: list[InteractiveMarker]
    poses: list[InteractiveMarkerPose]
    erases: list[str]
    def __init__(
        self,
        server_id: str | None = None,
        seq_num: int | None = None,
        type: int | None = None,
        markers: _Collection[InteractiveMarker] | None = None,
        poses: _Collection[InteractiveMarkerPose] | None = None,
        erases: _Collection[str] | None = None,
    ) -> None: ...

class Marker(_Ros2Message):
    ARROW: _Final = 0
    CUBE: _Final = 1
    SPHERE: _Final = 2
    CYLINDER: _Final = 3
    LINE_STRIP: _Final = 4
    LINE_LIST: _Final = 5
    CUBE_LIST: _Final = 6
    SPHERE_LIST: _Final = 7
    POINTS: _Final = 8
    TEXT_VIEW_FACING: _Final = 9
    MESH_RESOURCE: _Final = 10
    TRIANGLE_LIST: _Final = 11
    ARROW_STRIP: _Final = 12
    ADD: _Final = 0
    MODIFY: _Final = 0
    DELETE: _Final = 2
    DELETEALL: _Final = 3
    header: _std_msgs_msg.Header
    ns: str
    id: int
    type: int
    action: int
    pose: _geometry_msgs_msg.Pose
    scale: _geometry_msgs_msg.Vector3
    color: _std_msgs_msg.ColorRGBA
    lifetime: _builtin_interfaces_msg.Duration
    frame_locked: bool
    points: list[_geometry_msgs_msg.Point]
    colors: list[_std_msgs_msg.ColorRGBA]
    texture_resource: str
    texture: _sensor_msgs_msg.CompressedImage
    uv_coordinates: list[UVCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        ns: str | None = None,
        id: int | None = None,
        type: int | None = None,
        action: int | None = None,
        pose: _geometry_msgs_msg.Pose | None = None,
        scale: _geometry_msgs_msg.Vector3 | None = None,
        color: _std_msgs_msg.ColorRGBA | None = None,
        lifetime: _builtin_interfaces_msg.Duration | _Duration | float | None = None,
        frame_locked: bool | None = None,
        points: _Collection[_geometry_msgs_msg.Point] | None = None,
        colors: _Collection[_std_msgs_msg.ColorRGBA] | None = None,
        texture_resource: str | None = None,
        texture: _sensor_msgs_msg.CompressedImage | None = None,
        uv_coordinates: _Collection[UVCoordinate] | None = None,
        text: str | None = None,
        mesh_resource: str | None = None,
        mesh_file: MeshFile | None = None,
        mesh_use_embedded_materials: bool | None = None,
    ) -> None: ...

class MarkerArray(_Ros2Message):
    markers: list[Marker]
    def __init__(
        self,
        markers: _Collection[Marker] | None = None,
    ) -> None: ...

class MenuEntry(_Ros2Message):
    FEEDBACK: _Final = 0
    ROSRUN: _Final = 1
    ROSLAUNCH: _Final = 2
    id: int
    parent_id: int
    title: str
    command: str
    command_type: int
    def __init__(
        self,
        id: int | None = None,
        parent_id: int | None = None,
        title: str | None = None,
        command: str | None = None,
        command_type: int | None = None,
    ) -> None: ...

class MeshFile(_Ros2Message):
    filename: str
    data: bytes
    def __init__(
        self,
        filename: str | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UVCoordinate(_Ros2Message):
    u: float
    v: float
    def __init__(
        self,
        u: float | None = None,
        v: float | None = None,
    ) -> None: ...
