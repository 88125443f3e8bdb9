# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, Final as _Final, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.rcl_interfaces.msg as _rcl_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class DescribeParameters(_Ros2Service):
    Request: _TypeAlias = DescribeParameters_Request
    Response: _TypeAlias = DescribeParameters_Response
    _request_class: _ClassVar[type[DescribeParameters_Request]]
    _response_class: _ClassVar[type[DescribeParameters_Response]]

class DescribeParameters_Request(_Ros2Message):
    names: list[str]
    def __init__(
        self,
        names: _Collection[str] | None = None,
    ) -> None: ...

class DescribeParameters_Response(_Ros2Message):
    descriptors: list[_rcl_interfaces_msg.ParameterDescriptor]
    def __init__(
        self,
        descriptors: _Collection[_rcl_interfaces_msg.ParameterDescriptor] | None = None,
    ) -> None: ...

class GetLoggerLevels(_Ros2Service):
    Request: _TypeAlias = GetLoggerLevels_Request
    Response: _TypeAlias = GetLoggerLevels_Response
    _request_class: _ClassVar[type[GetLoggerLevels_Request]]
    _response_class: _ClassVar[type[GetLoggerLevels_Response]]

class GetLoggerLevels_Request(_Ros2Message):
    names: list[str]
    def __init__(
        self,
        names: _Collection[str] | None = None,
    ) -> None: ...

class GetLoggerLevels_Response(_Ros2Message):
    levels: list[_rcl_interfaces_msg.LoggerLevel]
    def __init__(
        self,
        levels: _Collection[_rcl_interfaces_msg.LoggerLevel] | None = None,
    ) -> None: ...

class GetParameterTypes(_Ros2Service):
    Request: _TypeAlias = GetParameterTypes_Request
    Response: _TypeAlias = GetParameterTypes_Response
    _request_class: _ClassVar[type[GetParameterTypes_Request]]
    _response_class: _ClassVar[type[GetParameterTypes_Response]]

class GetParameterTypes_Request(_Ros2Message):
    names: list[str]
    def __init__(
        self,
        names: _Collection[str] | None = None,
    ) -> None: ...

class GetParameterTypes_Response(_Ros2Message):
    types: bytes
    def __init__(
        self,
        types: _Collection[int] | None = None,
    ) -> None: ...

class GetParameters(_Ros2Service):
    Request: _TypeAlias = GetParameters_Request
    Response: _TypeAlias = GetParameters_Response
    _request_class: _ClassVar[type[GetParameters_Request]]
    _response_class: _ClassVar[type[GetParameters_Response]]

class GetParameters_Request(_Ros2Message):
    names: list[str]
    def __init__(
        self,
        names: _Collection[str] | None = None,
    ) -> None: ...

class GetParameters_Response(_Ros2Message):
    values: list[_rcl_interfaces_msg.ParameterValue]
    def __init__(
        self,
        values: _Collection[_rcl_interfaces_msg.ParameterValue] | None = None,
    ) -> None: ...

class ListParameters(_Ros2Service):
    Request: _TypeAlias = ListParameters_Request
    Response: _TypeAlias = ListParameters_Response
    _request_class: _ClassVar[type[ListParameters_Request]]
    _response_class: _ClassVar[type[ListParameters_Response]]

class ListParameters_Request(_Ros2Message):
    DEPTH_RECURSIVE: _Final = 0
    prefixes: list[str]
    depth: int
    def __init__(
        self,
        prefixes: _Collection[str] | None = None,
        depth: int | None = None,
    ) -> None: ...

class ListParameters_Response(_Ros2Message):
    result: _rcl_interfaces_msg.ListParametersResult
    def __init__(
        self,
        result: _rcl_interfaces_msg.ListParametersResult | None = None,
    ) -> None: ...

class SetLoggerLevels(_Ros2Service):
    Request: _TypeAlias = SetLoggerLevels_Request
    Response: _TypeAlias = SetLoggerLevels_Response
    _request_class: _ClassVar[type[SetLoggerLevels_Request]]
    _response_class: _ClassVar[type[SetLoggerLevels_Response]]

class SetLoggerLevels_Request(_Ros2Message):
    levels: list[_rcl_interfaces_msg.LoggerLevel]
    def __init__(
        self,
        levels: _Collection[_rcl_interfaces_msg.LoggerLevel] | None = None,
    ) -> None: ...

class SetLoggerLevels_Response(_Ros2Message):
    results: list[_rcl_interfaces_msg.SetLoggerLevelsResult]
    def __init__(
        self,
        results: _Collection[_rcl_interfaces_msg.SetLoggerLevelsResult] | None = None,
    ) -> None: ...

class SetParameters(_Ros2Service):
    Request: _TypeAlias = SetParameters_Request
    Response: _TypeAlias = SetParameters_Response
    _request_class: _ClassVar[type[SetParameters_Request]]
    _response_class: _ClassVar[type[SetParameters_Response]]

class SetParameters_Request(_Ros2Message):
    parameters: list[_rcl_interfaces_msg.Parameter]
    def __init__(
        self,
        parameters: _Collection[_rcl_interfaces_msg.Parameter] | None = None,
    ) -> None: ...

class SetParameters_Response(_Ros2Message):
    results: list[_rcl_interfaces_msg.SetParametersResult]
    def __init__(
        self,
        results: _Collection[_rcl_interfaces_msg.SetParametersResult] | None = None,
    ) -> None: ...

class SetParametersAtomically(_Ros2Service):
    Request: _TypeAlias = SetParametersAtomically_Request
    Response: _TypeAlias = SetParametersAtomically_Response
    _request_class: _ClassVar[type[SetParametersAtomically_Request]]
    _response_class: _ClassVar[type[SetParametersAtomically_Response]]

class SetParametersAtomically_Request(_Ros2Message):
    parameters: list[_rcl_interfaces_msg.Parameter]
    def __init__(
        self,
        parameters: _Collection[_rcl_interfaces_msg.Parameter] | None = None,
    ) -> None: ...

class SetParametersAtomically_Response(_Ros2Message):
    result: _rcl_interfaces_msg.SetParametersResult
    def __init__(
        self,
        result: _rcl_interfaces_msg.SetParametersResult | None = None,
    ) -> None: ...
