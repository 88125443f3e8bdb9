# Written by `actionlib interface stubs`; changes are lost.
from typing import ClassVar as _ClassVar, Final as _Final
from actionlib_core.interfaces import Message as _Message
from actionlib_core.interfaces import ServiceType as _ServiceType

class DemoSrv(_ServiceType):
    _request_class: _ClassVar[type[DemoSrvRequest]]
    _response_class: _ClassVar[type[DemoSrvResponse]]

class DemoSrvRequest(_Message):
    in_: str  # Say something, get an answer.
    def __init__(
        self,
        in_: str | None = None,
    ) -> None: ...

class DemoSrvResponse(_Message):
    out: str
    def __init__(
        self,
        out: str | None = None,
    ) -> None: ...

class Permit(_ServiceType):
    _request_class: _ClassVar[type[PermitRequest]]
    _response_class: _ClassVar[type[PermitResponse]]

class PermitRequest(_Message):
    PICK_UP: _Final = 1  # May this robot take the next step of an order? Asked before it, so that the answer is on record. it is about to take the parcel
    DRIVE_OFF: _Final = 2  # it has the parcel and is about to leave with it
    HAND_OVER: _Final = 3  # it is about to hand the parcel over
    order: str
    attempt: int
    robot: str
    step: int
    def __init__(
        self,
        order: str | None = None,
        attempt: int | None = None,
        robot: str | None = None,
        step: int | None = None,
    ) -> None: ...

class PermitResponse(_Message):
    granted: bool
    reason: str  # why not
    def __init__(
        self,
        granted: bool | None = None,
        reason: str | None = None,
    ) -> None: ...
