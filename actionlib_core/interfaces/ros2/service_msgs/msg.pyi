# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class ServiceEventInfo(_Ros2Message):
    REQUEST_SENT: _Final = 0
    REQUEST_RECEIVED: _Final = 1
    RESPONSE_SENT: _Final = 2
    RESPONSE_RECEIVED: _Final = 3
    event_type: int
    stamp: _builtin_interfaces_msg.Time
    client_gid: bytes
    sequence_number: int
    def __init__(
        self,
        event_type: int | None = None,
        stamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        client_gid: _Collection[int] | None = None,
        sequence_number: int | None = None,
    ) -> None: ...
