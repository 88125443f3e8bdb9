# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from actionlib_core.interfaces import Message as _Message
from actionlib_core.time import Duration as _Duration
from actionlib_core.time import Time as _Time

class Bool(_Message):
    data: bool
    def __init__(
        self,
        data: bool | None = None,
    ) -> None: ...

class Byte(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class ByteMultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Char(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class ColorRGBA(_Message):
    """A colour; each part from 0 to 1."""

    r: float
    g: float
    b: float
    a: float  # opacity: 0 is invisible
    def __init__(
        self,
        r: float | None = None,
        g: float | None = None,
        b: float | None = None,
        a: float | None = None,
    ) -> None: ...

class Duration(_Message):
    data: _Duration
    def __init__(
        self,
        data: _Duration | float | None = None,
    ) -> None: ...

class Empty(_Message):
    """Carries nothing but its own arrival."""

    def __init__(self) -> None: ...

class Float32(_Message):
    data: float
    def __init__(
        self,
        data: float | None = None,
    ) -> None: ...

class Float32MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[float]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[float] | None = None,
    ) -> None: ...

class Float64(_Message):
    data: float
    def __init__(
        self,
        data: float | None = None,
    ) -> None: ...

class Float64MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[float]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[float] | None = None,
    ) -> None: ...

class Header(_Message):
    """When and where the data that follow are valid."""

    seq: int  # counts the messages; set by the publisher, 0 will do
    stamp: _Time  # time of the data, 0: not said
    frame_id: str  # coordinate frame of the data, for example map or base_link
    def __init__(
        self,
        seq: int | None = None,
        stamp: _Time | float | None = None,
        frame_id: str | None = None,
    ) -> None: ...

class Int16(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int16MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int32(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int32MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int64(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int64MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class Int8(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class Int8MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class MultiArrayDimension(_Message):
    label: str  # name of the dimension
    size: int  # number of elements
    stride: int  # elements from one index to the next of the dimension before
    def __init__(
        self,
        label: str | None = None,
        size: int | None = None,
        stride: int | None = None,
    ) -> None: ...

class MultiArrayLayout(_Message):
    """How a flat array holds several dimensions, the outermost first."""

    dim: list[MultiArrayDimension]
    data_offset: int  # elements before the first one
    def __init__(
        self,
        dim: _Collection[MultiArrayDimension] | None = None,
        data_offset: int | None = None,
    ) -> None: ...

class String(_Message):
    data: str
    def __init__(
        self,
        data: str | None = None,
    ) -> None: ...

class Time(_Message):
    data: _Time
    def __init__(
        self,
        data: _Time | float | None = None,
    ) -> None: ...

class UInt16(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt16MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt32(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt32MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt64(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt64MultiArray(_Message):
    layout: MultiArrayLayout
    data: list[int]
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...

class UInt8(_Message):
    data: int
    def __init__(
        self,
        data: int | None = None,
    ) -> None: ...

class UInt8MultiArray(_Message):
    layout: MultiArrayLayout
    data: bytes
    def __init__(
        self,
        layout: MultiArrayLayout | None = None,
        data: _Collection[int] | None = None,
    ) -> None: ...
