# Written by `actionlib interface stubs`; changes are lost.
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class Clock(_Ros2Message):
    clock: _builtin_interfaces_msg.Time
    def __init__(
        self,
        clock: _builtin_interfaces_msg.Time | _Time | float | None = None,
    ) -> None: ...
