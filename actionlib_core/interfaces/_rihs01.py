"""The type hash of ROS 2 (RIHS01): the SHA-256 of a description of a type and those that it uses.

Source: ROS 2 REP 2016 and the field type ids of `type_description_interfaces/msg/FieldType`. Here,
as a robot's types are compared in every program that drives it; `rosbags` would bring NumPy along.
"""

from __future__ import annotations

import hashlib
import json
import re
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

_IDS: Final = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8,
    "uint64": 9, "float32": 10, "float64": 11, "float128": 12, "char": 13, "wchar": 14, "bool": 15,
    "byte": 16, "string": 17, "wstring": 18,
}  # fmt: skip
_BOUNDED: Final = {"string": 21, "wstring": 22}
_NESTED: Final = 1
_ARRAY, _BOUNDED_SEQUENCE, _SEQUENCE = 48, 96, 144
_SPELT = re.compile(r"([\w/]+)(?:<=(\d+))?(?:\[(<=)?(\d*)\])?")
_EMPTY: Final = [("uint8", "structure_needs_at_least_one_member")]


def rihs01_of(name: str, fields_of: Callable[[str], list[tuple[str, str]]]) -> str:
    """Return the type hash of a ROS 2 type, "RIHS01_" and 64 hexadecimal digits.

    Args:
        name: Its name, "pkg/kind/Name".
        fields_of: Returns (type, name) of each field of a type, message types as "pkg/kind/Name".
    """
    described: dict[str, dict[str, Any]] = {}
    waiting = [name]
    while waiting:
        current = waiting.pop()
        if current in described:
            continue
        fields = [_field(kind, field) for kind, field in fields_of(current) or _EMPTY]
        described[current] = {"type_name": current, "fields": fields}
        waiting += [used for one in fields if (used := one["type"]["nested_type_name"])]
    document = {
        "type_description": described.pop(name),
        "referenced_type_descriptions": [described[used] for used in sorted(described)],
    }
    return f"RIHS01_{hashlib.sha256(json.dumps(document).encode()).hexdigest()}"


def _field(kind: str, name: str) -> dict[str, Any]:
    match = _SPELT.fullmatch(kind)
    assert match is not None, kind
    base, bound, is_bounded, length = match[1], int(match[2] or 0), match[3], int(match[4] or 0)
    nested = base if "/" in base else ""
    type_id = _NESTED if nested else _BOUNDED[base] if bound else _IDS[base]
    if kind.endswith("]"):
        type_id += _SEQUENCE if not length else _BOUNDED_SEQUENCE if is_bounded else _ARRAY
    return {
        "name": name,
        "type": {
            "type_id": type_id,
            "capacity": length,
            "string_capacity": bound,
            "nested_type_name": nested,
        },
    }
