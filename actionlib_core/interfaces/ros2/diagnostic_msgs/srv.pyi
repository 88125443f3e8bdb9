# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
import actionlib_core.interfaces.ros2.diagnostic_msgs.msg as _diagnostic_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class AddDiagnostics(_Ros2Service):
    Request: _TypeAlias = AddDiagnostics_Request
    Response: _TypeAlias = AddDiagnostics_Response
    _request_class: _ClassVar[type[AddDiagnostics_Request]]
    _response_class: _ClassVar[type[AddDiagnostics_Response]]

class AddDiagnostics_Request(_Ros2Message):
    load_namespace: str
    def __init__(
        self,
        load_namespace: str | None = None,
    ) -> None: ...

class AddDiagnostics_Response(_Ros2Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...

class SelfTest(_Ros2Service):
    Request: _TypeAlias = SelfTest_Request
    Response: _TypeAlias = SelfTest_Response
    _request_class: _ClassVar[type[SelfTest_Request]]
    _response_class: _ClassVar[type[SelfTest_Response]]

class SelfTest_Request(_Ros2Message):
    def __init__(self) -> None: ...

class SelfTest_Response(_Ros2Message):
    id: str
    passed: int
    status: list[_diagnostic_msgs_msg.DiagnosticStatus]
    def __init__(
        self,
        id: str | None = None,
        passed: int | None = None,
        status: _Collection[_diagnostic_msgs_msg.DiagnosticStatus] | None = None,
    ) -> None: ...
