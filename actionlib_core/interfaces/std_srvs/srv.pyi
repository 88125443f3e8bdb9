# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class Empty(_ServiceType):
    _request_class: _ClassVar[type[EmptyRequest]]
    _response_class: _ClassVar[type[EmptyResponse]]

class EmptyRequest(_Message):
    def __init__(self) -> None: ...

class EmptyResponse(_Message):
    def __init__(self) -> None: ...

class SetBool(_ServiceType):
    _request_class: _ClassVar[type[SetBoolRequest]]
    _response_class: _ClassVar[type[SetBoolResponse]]

class SetBoolRequest(_Message):
    data: bool  # on or off
    def __init__(
        self,
        data: bool | None = None,
    ) -> None: ...

class SetBoolResponse(_Message):
    success: bool  # whether it worked
    message: str  # why, or why not
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...

class Trigger(_ServiceType):
    _request_class: _ClassVar[type[TriggerRequest]]
    _response_class: _ClassVar[type[TriggerResponse]]

class TriggerRequest(_Message):
    def __init__(self) -> None: ...

class TriggerResponse(_Message):
    success: bool  # whether the triggered action worked
    message: str  # why, or why not
    def __init__(
        self,
        success: bool | None = None,
        message: str | None = None,
    ) -> None: ...
