# Written by `actionlib interface stubs`; changes are lost.
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class ObjectType(_Ros2Message):
    key: str
    db: str
    def __init__(
        self,
        key: str | None = None,
        db: str | None = None,
    ) -> None: ...
