# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.std_msgs.msg as _std_msgs_msg
from actionlib_core.interfaces import Message as _Message

class DiagnosticArray(_Message):
    """States of the parts of a robot."""

    header: _std_msgs_msg.Header
    status: list[DiagnosticStatus]
    def __init__(
        self,
        header: _std_msgs_msg.Header | None = None,
        status: _Collection[DiagnosticStatus] | None = None,
    ) -> None: ...

class DiagnosticStatus(_Message):
    """State of one part of a robot."""

    OK: _Final = 0
    WARN: _Final = 1
    ERROR: _Final = 2
    STALE: _Final = 3
    level: int  # OK, WARN, ERROR or STALE
    name: str  # of the part
    message: str  # for people to read
    hardware_id: str  # which piece of hardware
    values: list[KeyValue]  # further figures
    def __init__(
        self,
        level: int | None = None,
        name: str | None = None,
        message: str | None = None,
        hardware_id: str | None = None,
        values: _Collection[KeyValue] | None = None,
    ) -> None: ...

class KeyValue(_Message):
    key: str
    value: str
    def __init__(
        self,
        key: str | None = None,
        value: str | None = None,
    ) -> None: ...
