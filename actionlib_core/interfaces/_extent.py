"""How large and how deep a type is: what no computer could make is refused at its definition."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, NamedTuple

from actionlib_core.interfaces._arrays import STRUCT_CODES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actionlib_core.interfaces._definition import FieldType

LARGEST = 100_000_000  # bytes of a message with its default values
MOST_FIELDS = 50_000  # the code that writes and reads has a line for each
DEEPEST = 50  # types in types: a value is walked down by calls in calls
NESTED = "types in one another"
MOST_LOOPS = 19  # arrays in arrays: Python has no more loops in a loop

_SIZES = {base: struct.calcsize(f"<{code}") for base, code in STRUCT_CODES.items()}
_SIZES |= {"string": 4, "time": 8, "duration": 8}
_LENGTH_SIZE = 4  # of a dynamic array


class Extent(NamedTuple):
    """What a type, or a field, asks for.

    Attributes:
        size: Bytes of the default value.
        fields: Fields, those of nested types counted again at each place.
        depth: Types in types; 0 for a built-in one.
        loops: Arrays in arrays.
    """

    size: int
    fields: int
    depth: int
    loops: int


def field_extent(kind: FieldType, extent_of: Callable[[str], Extent]) -> Extent:
    """Return the extent of a field; `extent_of` returns that of a nested type."""
    inner = Extent(_SIZES[kind.base], 1, 0, 0) if kind.is_builtin else extent_of(kind.base)
    if not kind.is_array:
        return inner
    size = _LENGTH_SIZE if kind.length is None else kind.length * max(inner.size, 1)
    loops = inner.loops + (kind.base not in STRUCT_CODES)
    return inner._replace(size=size, loops=loops)


def message_extent(fields: Iterable[Extent]) -> Extent:
    """Return the extent of a message of these fields."""
    every = list(fields)
    return Extent(
        sum(field.size for field in every),
        sum(field.fields for field in every),
        1 + max((field.depth for field in every), default=0),
        max((field.loops for field in every), default=0),
    )


def find_excess(extent: Extent) -> tuple[str, str] | None:
    """Return which attribute of a message's extent is too much, and the problem; None when none."""
    problems = {
        "fields": (MOST_FIELDS, "fields, nested ones counted"),
        "depth": (DEEPEST, NESTED),
        "loops": (MOST_LOOPS, "arrays in one another"),
    }
    for attribute, (most, what) in problems.items():
        if (value := getattr(extent, attribute)) > most:
            return attribute, too_many(f"{value:,}", what, most)
    return ("size", too_large(f"{extent.size:,} bytes")) if extent.size > LARGEST else None


def too_many(got: str, what: str, most: int) -> str:
    """Return the problem of a count."""
    return f"got {got} {what}; expected {most:,} at most"


def too_large(what: str) -> str:
    """Return the problem of a message of a size."""
    return (
        f"got a message of {what} at least; expected {LARGEST:,} bytes at most. Try an array "
        "without a length"
    )
