# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class DiagnosticArray(_Ros2Message):
    header: _std_msgs_msg.Header
    status: list[DiagnosticStatus]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _Collection[DiagnosticStatus] | None = None,
    ) -> None: ...

class DiagnosticStatus(_Ros2Message):
    OK: _Final = 0
    WARN: _Final = 1
    ERROR: _Final = 2
    STALE: _Final = 3
    level: int
    name: str
    message: str
    hardware_id: str
    values: list[KeyValue]
    def __init__(
        self,
        level: int | None = None,
        name: str | None = None,
        message: str | None = None,
        hardware_id: str | None = None,
        values: _Collection[KeyValue] | None = None,
    ) -> None: ...

class KeyValue(_Ros2Message):
    key: str
    value: str
    def __init__(
        self,
        key: str | None = None,
        value: str | None = None,
    ) -> None: ...
