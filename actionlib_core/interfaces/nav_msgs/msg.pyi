# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.actionlib_msgs.msg as _actionlib_msgs_msg
import actionlib_core.interfaces.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Time as _Time

class GridCells(_Message):
    """Some cells of a grid."""

    header: _std_msgs_msg.Header
    cell_width: float  # [m]
    cell_height: float  # [m]
    cells: list[_geometry_msgs_msg.Point]  # their centres
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        cell_width: float | None = None,
        cell_height: float | None = None,
        cells: _Collection[_geometry_msgs_msg.Point] | None = None,
    ) -> None: ...

class MapMetaData(_Message):
    """Size and place of a grid map."""

    map_load_time: _Time  # when it was loaded
    resolution: float  # side of a cell [m]
    width: int  # number of columns
    height: int  # number of rows
    origin: _geometry_msgs_msg.Pose  # of the corner of cell (0, 0) in the map's frame
    def __init__(
        self,
        map_load_time: _Time | float | None = None,
        resolution: float | None = None,
        width: int | None = None,
        height: int | None = None,
        origin: _geometry_msgs_msg.Pose | None = None,
    ) -> None: ...

class OccupancyGrid(_Message):
    """A map of cells."""

    header: _std_msgs_msg.Header
    info: MapMetaData
    data: list[int]  # row by row from cell (0, 0): 0 free to 100 occupied, -1 unknown
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        info: MapMetaData | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Odometry(_Message):
    """Estimated motion: the pose in the frame of the header, the twist in the frame child_frame_id."""

    header: _std_msgs_msg.Header
    child_frame_id: str  # the moving frame, for example base_link
    pose: _geometry_msgs_msg.PoseWithCovariance
    twist: _geometry_msgs_msg.TwistWithCovariance
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        child_frame_id: str | None = None,
        pose: _geometry_msgs_msg.PoseWithCovariance | None = None,
        twist: _geometry_msgs_msg.TwistWithCovariance | None = None,
    ) -> None: ...

class Path(_Message):
    """A sequence of poses to follow."""

    header: _std_msgs_msg.Header
    poses: list[_geometry_msgs_msg.PoseStamped]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        poses: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
    ) -> None: ...

class GetMapAction(_Message):
    action_goal: GetMapActionGoal
    action_result: GetMapActionResult
    action_feedback: GetMapActionFeedback
    def __init__(
        self,
        action_goal: GetMapActionGoal | None = None,
        action_result: GetMapActionResult | None = None,
        action_feedback: GetMapActionFeedback | None = None,
    ) -> None: ...

class GetMapActionGoal(_Message):
    header: _std_msgs_msg.Header
    goal_id: _actionlib_msgs_msg.GoalID
    goal: GetMapGoal
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        goal_id: _actionlib_msgs_msg.GoalID | None = None,
        goal: GetMapGoal | None = None,
    ) -> None: ...

class GetMapActionResult(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    result: GetMapResult
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        result: GetMapResult | None = None,
    ) -> None: ...

class GetMapActionFeedback(_Message):
    header: _std_msgs_msg.Header
    status: _actionlib_msgs_msg.GoalStatus
    feedback: GetMapFeedback
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _actionlib_msgs_msg.GoalStatus | None = None,
        feedback: GetMapFeedback | None = None,
    ) -> None: ...

class GetMapGoal(_Message):
    def __init__(self) -> None: ...

class GetMapResult(_Message):
    map: OccupancyGrid
    def __init__(
        self,
        map: OccupancyGrid | None = None,
    ) -> None: ...

class GetMapFeedback(_Message):
    def __init__(self) -> None: ...
