# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class Duration(_Ros2Message):
    sec: int
    nanosec: int
    def __init__(
        self,
        sec: int | None = None,
        nanosec: int | None = None,
    ) -> None: ...

class Time(_Ros2Message):
    sec: int
    nanosec: int
    def __init__(
        self,
        sec: int | None = None,
        nanosec: int | None = None,
    ) -> None: ...
