# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class Bool(_Ros2Message):
    data: bool
    def __init__(
        self,
        data: bool | None = None,
    ) -> None: ...

class Byte(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class ByteMultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: bytes
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Char(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class ColorRGBA(_Ros2Message):
    r: float
    g: float
    b: float
    a: float
    def __init__(
        self,
        r: float | None = None,
        g: float | None = None,
        b: float | None = None,
        a: float | None = None,
    ) -> None: ...

class Empty(_Ros2Message):
    def __init__(self) -> None: ...

class Float32(_Ros2Message):
    data: float
    def __init__(
        self,
        data: float | None = None,
    ) -> None: ...

class Float32MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[float]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[float] | None = None,
    ) -> None: ...

class Float64(_Ros2Message):
    data: float
    def __init__(
        self,
        data: float | None = None,
    ) -> None: ...

class Float64MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[float]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[float] | None = None,
    ) -> None: ...

class Header(_Ros2Message):
    stamp: _builtin_interfaces_msg.Time
    frame_id: str
    def __init__(
        self,
        stamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        frame_id: str | None = None,
    ) -> None: ...

class Int16(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int16MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int32(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int32MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int64(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int64MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int8(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int8MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class MultiArrayDimension(_Ros2Message):
    label: str
    size: int
    stride: int
    def __init__(
        self,
        label: str | None = None,
        size: int | None = None,
        stride: int | None = None,
    ) -> None: ...

class MultiArrayLayout(_Ros2Message):
    dim: list[MultiArrayDimension]
    data_offset: int
    def __init__(
        self,
        dim: _Collection[MultiArrayDimension] | None = None,
        data_offset: int | None = None,
    ) -> None: ...

class String(_Ros2Message):
    data: str
    def __init__(
        self,
        data: str | None = None,
    ) -> None: ...

class UInt16(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt16MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt32(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt32MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt64(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt64MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt8(_Ros2Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt8MultiArray(_Ros2Message):
    layout: MultiArrayLayout
    data: bytes
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...
