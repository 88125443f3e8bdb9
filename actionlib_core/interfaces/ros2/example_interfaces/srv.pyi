# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, TypeAlias as _TypeAlias
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.interfaces import Ros2Service as _Ros2Service

class AddTwoInts(_Ros2Service):
    Request: _TypeAlias = AddTwoInts_Request
    Response: _TypeAlias = AddTwoInts_Response
    _request_class: _ClassVar[type[AddTwoInts_Request]]
    _response_class: _ClassVar[type[AddTwoInts_Response]]

class AddTwoInts_Request(_Ros2Message):
    a: int
    b: int
    def __init__(
        self,
        a: int | None = None,
        b: int | None = None,
    ) -> None: ...

class AddTwoInts_Response(_Ros2Message):
    sum: int
    def __init__(
        self,
        sum: int | None = None,
    ) -> None: ...

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
