# Written by `actionlib interface stubs`; changes are lost.
from collections.abc import Collection as _Collection
from typing import Final as _Final
from actionlib_core.interfaces import Ros2Message as _Ros2Message

class Field(_Ros2Message):
    name: str
    type: FieldType
    default_value: str
    def __init__(
        self,
        name: str | None = None,
        type: FieldType | None = None,
        default_value: str | None = None,
    ) -> None: ...

class FieldType(_Ros2Message):
    FIELD_TYPE_NOT_SET: _Final = 0
    FIELD_TYPE_NESTED_TYPE: _Final = 1
    FIELD_TYPE_INT8: _Final = 2
    FIELD_TYPE_UINT8: _Final = 3
    FIELD_TYPE_INT16: _Final = 4
    FIELD_TYPE_UINT16: _Final = 5
    FIELD_TYPE_INT32: _Final = 6
    FIELD_TYPE_UINT32: _Final = 7
    FIELD_TYPE_INT64: _Final = 8
    FIELD_TYPE_UINT64: _Final = 9
    FIELD_TYPE_FLOAT: _Final = 10
    FIELD_TYPE_DOUBLE: _Final = 11
    FIELD_TYPE_LONG_DOUBLE: _Final = 12
    FIELD_TYPE_CHAR: _Final = 13
    FIELD_TYPE_WCHAR: _Final = 14
    FIELD_TYPE_BOOLEAN: _Final = 15
    FIELD_TYPE_BYTE: _Final = 16
    FIELD_TYPE_STRING: _Final = 17
    FIELD_TYPE_WSTRING: _Final = 18
    FIELD_TYPE_FIXED_STRING: _Final = 19
    FIELD_TYPE_FIXED_WSTRING: _Final = 20
    FIELD_TYPE_BOUNDED_STRING: _Final = 21
    FIELD_TYPE_BOUNDED_WSTRING: _Final = 22
    FIELD_TYPE_NESTED_TYPE_ARRAY: _Final = 49
    FIELD_TYPE_INT8_ARRAY: _Final = 50
    FIELD_TYPE_UINT8_ARRAY: _Final = 51
    FIELD_TYPE_INT16_ARRAY: _Final = 52
    FIELD_TYPE_UINT16_ARRAY: _Final = 53
    FIELD_TYPE_INT32_ARRAY: _Final = 54
    FIELD_TYPE_UINT32_ARRAY: _Final = 55
    FIELD_TYPE_INT64_ARRAY: _Final = 56
    FIELD_TYPE_UINT64_ARRAY: _Final = 57
    FIELD_TYPE_FLOAT_ARRAY: _Final = 58
    FIELD_TYPE_DOUBLE_ARRAY: _Final = 59
    FIELD_TYPE_LONG_DOUBLE_ARRAY: _Final = 60
    FIELD_TYPE_CHAR_ARRAY: _Final = 61
    FIELD_TYPE_WCHAR_ARRAY: _Final = 62
    FIELD_TYPE_BOOLEAN_ARRAY: _Final = 63
    FIELD_TYPE_BYTE_ARRAY: _Final = 64
    FIELD_TYPE_STRING_ARRAY: _Final = 65
    FIELD_TYPE_WSTRING_ARRAY: _Final = 66
    FIELD_TYPE_FIXED_STRING_ARRAY: _Final = 67
    FIELD_TYPE_FIXED_WSTRING_ARRAY: _Final = 68
    FIELD_TYPE_BOUNDED_STRING_ARRAY: _Final = 69
    FIELD_TYPE_BOUNDED_WSTRING_ARRAY: _Final = 70
    FIELD_TYPE_NESTED_TYPE_BOUNDED_SEQUENCE: _Final = 97
    FIELD_TYPE_INT8_BOUNDED_SEQUENCE: _Final = 98
    FIELD_TYPE_UINT8_BOUNDED_SEQUENCE: _Final = 99
    FIELD_TYPE_INT16_BOUNDED_SEQUENCE: _Final = 100
    FIELD_TYPE_UINT16_BOUNDED_SEQUENCE: _Final = 101
    FIELD_TYPE_INT32_BOUNDED_SEQUENCE: _Final = 102
    FIELD_TYPE_UINT32_BOUNDED_SEQUENCE: _Final = 103
    FIELD_TYPE_INT64_BOUNDED_SEQUENCE: _Final = 104
    FIELD_TYPE_UINT64_BOUNDED_SEQUENCE: _Final = 105
    FIELD_TYPE_FLOAT_BOUNDED_SEQUENCE: _Final = 106
    FIELD_TYPE_DOUBLE_BOUNDED_SEQUENCE: _Final = 107
    FIELD_TYPE_LONG_DOUBLE_BOUNDED_SEQUENCE: _Final = 108
    FIELD_TYPE_CHAR_BOUNDED_SEQUENCE: _Final = 109
    FIELD_TYPE_WCHAR_BOUNDED_SEQUENCE: _Final = 110
    FIELD_TYPE_BOOLEAN_BOUNDED_SEQUENCE: _Final = 111
    FIELD_TYPE_BYTE_BOUNDED_SEQUENCE: _Final = 112
    FIELD_TYPE_STRING_BOUNDED_SEQUENCE: _Final = 113
    FIELD_TYPE_WSTRING_BOUNDED_SEQUENCE: _Final = 114
    FIELD_TYPE_FIXED_STRING_BOUNDED_SEQUENCE: _Final = 115
    FIELD_TYPE_FIXED_WSTRING_BOUNDED_SEQUENCE: _Final = 116
    FIELD_TYPE_BOUNDED_STRING_BOUNDED_SEQUENCE: _Final = 117
    FIELD_TYPE_BOUNDED_WSTRING_BOUNDED_SEQUENCE: _Final = 118
    FIELD_TYPE_NESTED_TYPE_UNBOUNDED_SEQUENCE: _Final = 145
    FIELD_TYPE_INT8_UNBOUNDED_SEQUENCE: _Final = 146
    FIELD_TYPE_UINT8_UNBOUNDED_SEQUENCE: _Final = 147
    FIELD_TYPE_INT16_UNBOUNDED_SEQUENCE: _Final = 148
    FIELD_TYPE_UINT16_UNBOUNDED_SEQUENCE: _Final = 149
    FIELD_TYPE_INT32_UNBOUNDED_SEQUENCE: _Final = 150
    FIELD_TYPE_UINT32_UNBOUNDED_SEQUENCE: _Final = 151
    FIELD_TYPE_INT64_UNBOUNDED_SEQUENCE: _Final = 152
    FIELD_TYPE_UINT64_UNBOUNDED_SEQUENCE: _Final = 153
    FIELD_TYPE_FLOAT_UNBOUNDED_SEQUENCE: _Final = 154
    FIELD_TYPE_DOUBLE_UNBOUNDED_SEQUENCE: _Final = 155
    FIELD_TYPE_LONG_DOUBLE_UNBOUNDED_SEQUENCE: _Final = 156
    FIELD_TYPE_CHAR_UNBOUNDED_SEQUENCE: _Final = 157
    FIELD_TYPE_WCHAR_UNBOUNDED_SEQUENCE: _Final = 158
    FIELD_TYPE_BOOLEAN_UNBOUNDED_SEQUENCE: _Final = 159
    FIELD_TYPE_BYTE_UNBOUNDED_SEQUENCE: _Final = 160
    FIELD_TYPE_STRING_UNBOUNDED_SEQUENCE: _Final = 161
    FIELD_TYPE_WSTRING_UNBOUNDED_SEQUENCE: _Final = 162
    FIELD_TYPE_FIXED_STRING_UNBOUNDED_SEQUENCE: _Final = 163
    FIELD_TYPE_FIXED_WSTRING_UNBOUNDED_SEQUENCE: _Final = 164
    FIELD_TYPE_BOUNDED_STRING_UNBOUNDED_SEQUENCE: _Final = 165
    FIELD_TYPE_BOUNDED_WSTRING_UNBOUNDED_SEQUENCE: _Final = 166
    type_id: int
    capacity: int
    string_capacity: int
    nested_type_name: str
    def __init__(
        self,
        type_id: int | None = None,
        capacity: int | None = None,
        string_capacity: int | None = None,
        nested_type_name: str | None = None,
    ) -> None: ...

class IndividualTypeDescription(_Ros2Message):
    type_name: str
    fields: list[Field]
    def __init__(
        self,
        type_name: str | None = None,
        fields: _Collection[Field] | None = None,
    ) -> None: ...

class KeyValue(_Ros2Message):
    key: str
    value: str
    def __init__(
        self,
        key: str | None = None,
        value: str | None = None,
    ) -> None: ...

class TypeDescription(_Ros2Message):
    type_description: IndividualTypeDescription
    referenced_type_descriptions: list[IndividualTypeDescription]
    def __init__(
        self,
        type_description: IndividualTypeDescription | None = None,
        referenced_type_descriptions: _Collection[IndividualTypeDescription] | None = None,
    ) -> None: ...

class TypeSource(_Ros2Message):
    type_name: str
    encoding: str
    raw_file_contents: str
    def __init__(
        self,
        type_name: str | None = None,
        encoding: str | None = None,
        raw_file_contents: str | None = None,
    ) -> None: ...
