# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service
from actionlib_core.time import Time as _Time

class QueryCalibrationState(_Ros2Service):
    Request: _TypeAlias = QueryCalibrationState_Request
    Response: _TypeAlias = QueryCalibrationState_Response
    _request_class: _ClassVar[type[QueryCalibrationState_Request]]
    _response_class: _ClassVar[type[QueryCalibrationState_Response]]

class QueryCalibrationState_Request(_Ros2Message):
    def __init__(self) -> None: ...

class QueryCalibrationState_Response(_Ros2Message):
    is_calibrated: bool
    def __init__(
        self,
        is_calibrated: bool | None = None,
    ) -> None: ...

class QueryTrajectoryState(_Ros2Service):
    Request: _TypeAlias = QueryTrajectoryState_Request
    Response: _TypeAlias = QueryTrajectoryState_Response
    _request_class: _ClassVar[type[QueryTrajectoryState_Request]]
    _response_class: _ClassVar[type[QueryTrajectoryState_Response]]

class QueryTrajectoryState_Request(_Ros2Message):
    time: _builtin_interfaces_msg.Time
    def __init__(
        self,
        time: _builtin_interfaces_msg.Time | _Time | float | None = None,
    ) -> None: ...

class QueryTrajectoryState_Response(_Ros2Message):
    success: bool
    message: str
    name: list[str]
    position: list[float]
    velocity: list[float]
    acceleration: list[float]
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
        name: _Collection[str] | None = None,
        position: _Collection[float] | None = None,
        velocity: _Collection[float] | None = None,
        acceleration: _Collection[float] | None = None,
    ) -> None: ...

class SetOdometry(_Ros2Service):
    Request: _TypeAlias = SetOdometry_Request
    Response: _TypeAlias = SetOdometry_Response
    _request_class: _ClassVar[type[SetOdometry_Request]]
    _response_class: _ClassVar[type[SetOdometry_Response]]

class SetOdometry_Request(_Ros2Message):
    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    def __init__(
        self,
        x: float | None = None,
        y: float | None = None,
        z: float | None = None,
        roll: float | None = None,
        pitch: float | None = None,
        yaw: float | None = None,
    ) -> None: ...

class SetOdometry_Response(_Ros2Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...
