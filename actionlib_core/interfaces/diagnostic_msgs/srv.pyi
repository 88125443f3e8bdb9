# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import ClassVar as _ClassVar
import actionlib_core.interfaces.diagnostic_msgs.msg as _diagnostic_msgs_msg
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class AddDiagnostics(_ServiceType):
    _request_class: _ClassVar[type[AddDiagnosticsRequest]]
    _response_class: _ClassVar[type[AddDiagnosticsResponse]]

class AddDiagnosticsRequest(_Message):
    load_namespace: str
    def __init__(
        self,
        load_namespace: str | None = None,
    ) -> None: ...

class AddDiagnosticsResponse(_Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...

class SelfTest(_ServiceType):
    _request_class: _ClassVar[type[SelfTestRequest]]
    _response_class: _ClassVar[type[SelfTestResponse]]

class SelfTestRequest(_Message):
    def __init__(self) -> None: ...

class SelfTestResponse(_Message):
    id: str
    passed: int
    status: list[_diagnostic_msgs_msg.DiagnosticStatus]
    def __init__(
        self,
        id: str | None = None,
        passed: int | None = None,
        status: _Collection[_diagnostic_msgs_msg.DiagnosticStatus] | None = None,
    ) -> None: ...
