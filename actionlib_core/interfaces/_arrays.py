"""Conversion of array fields to bytes, called by the generated serialisers."""

from __future__ import annotations

import struct
import sys
from typing import Any

STRUCT_CODES = {
    "int8": "b",
    "byte": "b",
    "uint8": "B",
    "char": "B",
    "octet": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
    "bool": "?",
}
"""The `struct` code of each numeric type."""

BOOLS = {False: 0, True: 1}
"""A bool's byte; a value that equals neither raises KeyError."""

# numpy's "l" is a C long, of 8 or 4 bytes; ours are the codes of the standard sizes.
_NATIVE = {"l": "q", "L": "Q"} if struct.calcsize("l") == 8 else {"l": "i", "L": "I"}  # noqa: PLR2004 # 64-bit


class MismatchError(Exception):
    """A value that the fast path does not handle, but perhaps the slow one (`coerced`)."""


def numbers(code: str, values: Any) -> bytes:
    """Return the bytes of a numeric array: a list, a tuple or a 1-D buffer such as numpy's."""
    kind = values.__class__
    if kind is list or kind is tuple:
        return struct.pack(f"<{len(values)}{code}", *values)
    if hasattr(values, "__array_interface__") or hasattr(values, "itemsize"):
        return _buffer(code, values)
    raise MismatchError


def _buffer(code: str, values: Any) -> bytes:
    view = memoryview(values)
    if view.ndim != 1:
        raise MismatchError
    spelt = view.format.lstrip("@=<") if view.format else "B"
    if _NATIVE.get(spelt, spelt) == code and sys.byteorder == "little":
        return view.tobytes()
    return struct.pack(f"<{len(view)}{code}", *values.tolist())


def octets(values: Any) -> bytes:
    """Return the bytes of a `uint8[]` or `char[]`: bytes-like, or a list or tuple of 0 to 255."""
    kind = values.__class__
    if kind is bytes:
        return values  # type: ignore[no-any-return] # narrowed by its class
    if kind is list or kind is tuple or kind is bytearray:
        return bytes(values)
    if hasattr(values, "__array_interface__") or hasattr(values, "itemsize"):
        view = memoryview(values)
        if view.ndim == 1:
            return view.tobytes() if view.itemsize == 1 else bytes(values.tolist())
    raise MismatchError


def bools(values: Any) -> bytes:
    """Return the bytes of a `bool[]`."""
    if values.__class__ is not list and values.__class__ is not tuple:
        if not hasattr(values, "tolist"):
            raise MismatchError
        values = values.tolist()
    return bytes([BOOLS[value] for value in values])


def fixed(values: Any, length: int) -> Any:
    """Return `values` if it has `length` elements."""
    if len(values) != length:
        raise MismatchError
    return values


def objects(values: Any) -> Any:
    """Return `values` if it is a list or a tuple; a string, for example, is not accepted."""
    if values.__class__ is not list and values.__class__ is not tuple:
        raise MismatchError
    return values


def same(left: Any, right: Any) -> bool:
    """Compare two array fields, each a list, tuple, bytes or numpy array."""
    if left.__class__ is right.__class__ and left.__class__ in {list, tuple, bytes}:
        return bool(left == right)
    try:
        return list(left) == list(right)
    except TypeError:
        return False
