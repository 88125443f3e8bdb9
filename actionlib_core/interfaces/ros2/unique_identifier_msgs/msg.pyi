# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class UUID(_Ros2Message):
    uuid: bytes
    def __init__(
        self,
        uuid: _Collection[int] | None = None,
    ) -> None: ...
