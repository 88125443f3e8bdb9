# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class Empty(_Ros2Service):
    Request: _TypeAlias = Empty_Request
    Response: _TypeAlias = Empty_Response
    _request_class: _ClassVar[type[Empty_Request]]
    _response_class: _ClassVar[type[Empty_Response]]

class Empty_Request(_Ros2Message):
    def __init__(self) -> None: ...

class Empty_Response(_Ros2Message):
    def __init__(self) -> None: ...

class SetBool(_Ros2Service):
    Request: _TypeAlias = SetBool_Request
    Response: _TypeAlias = SetBool_Response
    _request_class: _ClassVar[type[SetBool_Request]]
    _response_class: _ClassVar[type[SetBool_Response]]

class SetBool_Request(_Ros2Message):
    data: bool
    def __init__(
        self,
        data: bool | None = None,
    ) -> None: ...

class SetBool_Response(_Ros2Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...

class Trigger(_Ros2Service):
    Request: _TypeAlias = Trigger_Request
    Response: _TypeAlias = Trigger_Response
    _request_class: _ClassVar[type[Trigger_Request]]
    _response_class: _ClassVar[type[Trigger_Response]]

class Trigger_Request(_Ros2Message):
    def __init__(self) -> None: ...

class Trigger_Response(_Ros2Message):
    success: bool
    message: str
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...
