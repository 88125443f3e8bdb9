# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class FrameGraph(_ServiceType):
    _request_class: _ClassVar[type[FrameGraphRequest]]
    _response_class: _ClassVar[type[FrameGraphResponse]]

class FrameGraphRequest(_Message):
    def __init__(self) -> None: ...

class FrameGraphResponse(_Message):
    frame_yaml: str
    def __init__(
        self,
        frame_yaml: str | None = None,
    ) -> None: ...
