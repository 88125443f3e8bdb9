# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.geometry_msgs.msg as _geometry_msgs_msg
import actionlib_core.interfaces.ros2.moveit_msgs.msg as _moveit_msgs_msg
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class GetPositionFK(_Ros2Service):
    Request: _TypeAlias = GetPositionFK_Request
    Response: _TypeAlias = GetPositionFK_Response
    _request_class: _ClassVar[type[GetPositionFK_Request]]
    _response_class: _ClassVar[type[GetPositionFK_Response]]

class GetPositionFK_Request(_Ros2Message):
    header: _std_msgs_msg.Header
    fk_link_names: list[str]
    robot_state: _moveit_msgs_msg.RobotState
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        fk_link_names: _Collection[str] | None = None,
        robot_state: _moveit_msgs_msg.RobotState | None = None,
    ) -> None: ...

class GetPositionFK_Response(_Ros2Message):
    pose_stamped: list[_geometry_msgs_msg.PoseStamped]
    fk_link_names: list[str]
    error_code: _moveit_msgs_msg.MoveItErrorCodes
    def __init__(
        self,
        pose_stamped: _Collection[_geometry_msgs_msg.PoseStamped] | None = None,
        fk_link_names: _Collection[str] | None = None,
        error_code: _moveit_msgs_msg.MoveItErrorCodes | None = None,
    ) -> None: ...

class GetPositionIK(_Ros2Service):
    Request: _TypeAlias = GetPositionIK_Request
    Response: _TypeAlias = GetPositionIK_Response
    _request_class: _ClassVar[type[GetPositionIK_Request]]
    _response_class: _ClassVar[type[GetPositionIK_Response]]

class GetPositionIK_Request(_Ros2Message):
    ik_request: _moveit_msgs_msg.PositionIKRequest
    def __init__(
        self,
        ik_request: _moveit_msgs_msg.PositionIKRequest | None = None,
    ) -> None: ...

class GetPositionIK_Response(_Ros2Message):
    solution: _moveit_msgs_msg.RobotState
    error_code: _moveit_msgs_msg.MoveItErrorCodes
    def __init__(
        self,
        solution: _moveit_msgs_msg.RobotState | None = None,
        error_code: _moveit_msgs_msg.MoveItErrorCodes | None = None,
    ) -> None: ...
