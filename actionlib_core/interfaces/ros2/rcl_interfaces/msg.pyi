# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
import actionlib_core.interfaces.ros2.builtin_interfaces.msg as _builtin_interfaces_msg
from actionlib_core.interfaces import Ros2Message as _Ros2Message
from actionlib_core.time import Time as _Time

class FloatingPointRange(_Ros2Message):
    from_value: float
    to_value: float
    step: float
    def __init__(
        self,
        from_value: float | None = None,
        to_value: float | None = None,
        step: float | None = None,
    ) -> None: ...

class IntegerRange(_Ros2Message):
    from_value: int
    to_value: int
    step: int
    def __init__(
        self,
        from_value: int | None = None,
        to_value: int | None = None,
        step: int | None = None,
    ) -> None: ...

class ListParametersResult(_Ros2Message):
    names: list[str]
    prefixes: list[str]
    def __init__(
        self,
        names: _Collection[str] | None = None,
        prefixes: _Collection[str] | None = None,
    ) -> None: ...

class Log(_Ros2Message):
    DEBUG: _Final = 10
    INFO: _Final = 20
    WARN: _Final = 30
    ERROR: _Final = 40
    FATAL: _Final = 50
    stamp: _builtin_interfaces_msg.Time
    level: int
    name: str
    msg: str
    file: str
    function: str
    line: int
    def __init__(
        self,
        stamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        level: int | None = None,
        name: str | None = None,
        msg: str | None = None,
        file: str | None = None,
        function: str | None = None,
        line: int | None = None,
    ) -> None: ...

class LoggerLevel(_Ros2Message):
    LOG_LEVEL_UNKNOWN: _Final = 0
    LOG_LEVEL_DEBUG: _Final = 10
    LOG_LEVEL_INFO: _Final = 20
    LOG_LEVEL_WARN: _Final = 30
    LOG_LEVEL_ERROR: _Final = 40
    LOG_LEVEL_FATAL: _Final = 50
    name: str
    level: int
    def __init__(
        self,
        name: str | None = None,
        level: int | None = None,
    ) -> None: ...

class Parameter(_Ros2Message):
    name: str
    value: ParameterValue
    def __init__(
        self,
        name: str | None = None,
        value: ParameterValue | None = None,
    ) -> None: ...

class ParameterDescriptor(_Ros2Message):
    name: str
    type: int
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: list[FloatingPointRange]
    integer_range: list[IntegerRange]
    def __init__(
        self,
        name: str | None = None,
        type: int | None = None,
        description: str | None = None,
        additional_constraints: str | None = None,
        read_only: bool | None = None,
        dynamic_typing: bool | None = None,
        floating_point_range: _Collection[FloatingPointRange] | None = None,
        integer_range: _Collection[IntegerRange] | None = None,
    ) -> None: ...

class ParameterEvent(_Ros2Message):
    stamp: _builtin_interfaces_msg.Time
    node: str
    new_parameters: list[Parameter]
    changed_parameters: list[Parameter]
    deleted_parameters: list[Parameter]
    def __init__(
        self,
        stamp: _builtin_interfaces_msg.Time | _Time | float | None = None,
        node: str | None = None,
        new_parameters: _Collection[Parameter] | None = None,
        changed_parameters: _Collection[Parameter] | None = None,
        deleted_parameters: _Collection[Parameter] | None = None,
    ) -> None: ...

class ParameterEventDescriptors(_Ros2Message):
    new_parameters: list[ParameterDescriptor]
    changed_parameters: list[ParameterDescriptor]
    deleted_parameters: list[ParameterDescriptor]
    def __init__(
        self,
        new_parameters: _Collection[ParameterDescriptor] | None = None,
        changed_parameters: _Collection[ParameterDescriptor] | None = None,
        deleted_parameters: _Collection[ParameterDescriptor] | None = None,
    ) -> None: ...

class ParameterType(_Ros2Message):
    PARAMETER_NOT_SET: _Final = 0
    PARAMETER_BOOL: _Final = 1
    PARAMETER_INTEGER: _Final = 2
    PARAMETER_DOUBLE: _Final = 3
    PARAMETER_STRING: _Final = 4
    PARAMETER_BYTE_ARRAY: _Final = 5
    PARAMETER_BOOL_ARRAY: _Final = 6
    PARAMETER_INTEGER_ARRAY: _Final = 7
    PARAMETER_DOUBLE_ARRAY: _Final = 8
    PARAMETER_STRING_ARRAY: _Final = 9
    def __init__(self) -> None: ...

class ParameterValue(_Ros2Message):
    type: int
    bool_value: bool
    integer_value: int
    double_value: float
    string_value: str
    byte_array_value: bytes
    bool_array_value: list[bool]
    integer_array_value: list[int]
    double_array_value: list[float]
    string_array_value: list[str]
    def __init__(
        self,
        type: int | None = None,
        bool_value: bool | None = None,
        integer_value: int | None = None,
        double_value: float | None = None,
        string_value: str | None = None,
        byte_array_value: _Collection[int] | None = None,
        bool_array_value: _Collection[bool] | None = None,
        integer_array_value: _Collection[int] | None = None,
        double_array_value: _Collection[float] | None = None,
        string_array_value: _Collection[str] | None = None,
    ) -> None: ...

class SetLoggerLevelsResult(_Ros2Message):
    successful: bool
    reason: str
    def __init__(
        self,
        successful: bool | None = None,
        reason: str | None = None,
    ) -> None: ...

class SetParametersResult(_Ros2Message):
    successful: bool
    reason: str
    def __init__(
        self,
        successful: bool | None = None,
        reason: str | None = None,
    ) -> None: ...
