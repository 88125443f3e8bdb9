"""Values for display: their JSON form, or the text of their `repr`, unless that takes too long.

`repr` has no limit, so the parts of the value are counted first. That works for Python's
containers, messages, dataclasses, namespaces and exceptions, and for anything with a length; the
`__repr__` of any other class is called without a check.
"""

from __future__ import annotations

import math
from collections import UserDict, UserList, deque
from collections.abc import ItemsView, KeysView, ValuesView
from dataclasses import dataclass, fields
from itertools import chain
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

LONGEST_TEXT = 4_000
LONGEST_LIST = 1_000
DEEPEST = 20
MOST_ITEMS = 10_000
MOST_TEXT = 100_000
WIDEST_INT = 1_024  # bits
"""Limits of values in a record, which are for display, not for computing.

The first three apply to each part, the next two to a whole record, so that making one takes a few
milliseconds at most.
"""

_MOST_READ = 4 * LONGEST_TEXT  # characters in the parts of a `repr`, which is then cut
_DEEPEST_REPR = 100
_SMALL = frozenset({type(None), bool, float, complex, range, type})
_MAPPINGS = (dict, UserDict, MappingProxyType)
_LISTS = (list, tuple, set, frozenset, deque, UserList, KeysView, ValuesView, ItemsView)


@dataclass(slots=True)
class Room:
    """The remaining room in a record."""

    items: int = MOST_ITEMS
    text: int = MOST_TEXT


def text_of(value: Any, room: Room, depth: int = 0) -> str:
    """Return `repr(value)`, or a text with only the sizes of parts that are too large.

    It may be longer than the room for text: the caller cuts it. Each visited part reduces the room
    for items. If the value's own code raises, the text says so.
    """
    try:
        left = Room(room.items, min(room.text, _MOST_READ))
        fits = _fits(value, left, set())
        spent = room.items - max(left.items, 0)
        room.items -= spent if fits else spent // 4  # counting costs less than formatting
        return repr(value) if fits else _outline(value, room, depth)
    except Exception as error:  # noqa: BLE001  the user's code: show its failure instead
        return f"<{type(value).__name__}: its repr raised {type(error).__name__}>"


def _fits(value: Any, left: Room, above: set[int]) -> bool:
    """Return whether the `repr` is short enough; subtract its parts from `left`."""
    kind: Any = type(value)
    if kind in _SMALL or kind.__repr__ is object.__repr__:
        return True
    if isinstance(value, int):
        return value.bit_length() <= WIDEST_INT
    if isinstance(value, (str, bytes, bytearray)):
        left.text -= len(value)
        return left.text >= 0 and (isinstance(value, str) or len(value) <= LONGEST_LIST)
    size = _size(value)
    if size is not None and size > min(LONGEST_LIST, left.items):
        return False
    # `above` has the ids of the values around this one: Python's `repr` shows a cycle as "...", so
    # it adds nothing here.
    inside = _inside(value)
    return inside is None or id(value) in above or _all_fit(inside, left, {*above, id(value)})


def _all_fit(inside: Iterable[Any], left: Room, above: set[int]) -> bool:
    if len(above) > _DEEPEST_REPR:
        return False
    for one in inside:
        left.items -= 1
        if left.items < 0 or not _fits(one, left, above):
            return False
    return True


def _size(value: Any) -> int | None:
    if not hasattr(type(value), "__len__"):
        return None
    try:
        return len(value)
    except Exception:  # noqa: BLE001  the user's code; also a numpy array without dimensions
        return None


def _inside(value: Any) -> Iterable[Any] | None:
    """Return the parts of a value's `repr`; None if they are not known."""
    if isinstance(value, _LISTS):
        return value
    if isinstance(value, _MAPPINGS):
        return chain(value, value.values())
    named = _fields(value)
    return None if named is None else [part for _, part in named]


def _fields(value: Any) -> list[tuple[str, Any]] | None:
    """Return pairs (prefix, part) of a value whose `repr` looks like a call."""
    kind: Any = type(value)
    if hasattr(kind, "__dataclass_fields__") and hasattr(kind.__repr__, "__wrapped__"):
        names = [field.name for field in fields(value) if field.repr]
        return [(f"{name}=", getattr(value, name)) for name in names]
    if hasattr(kind, "_md5sum") and hasattr(kind, "__slots__"):
        return [(f"{name}=", getattr(value, name, None)) for name in kind.__slots__]
    if isinstance(value, SimpleNamespace):
        return [(f"{name}=", part) for name, part in vars(value).items()]
    if isinstance(value, BaseException):
        return [("", part) for part in value.args]
    return None


def _outline(value: Any, room: Room, depth: int) -> str:
    """Return the text of a value that does not fit: its parts if there are few, else its size."""
    kind: Any = type(value)
    if isinstance(value, int):
        return f"<int of {value.bit_length()} bits>"
    if isinstance(value, str):
        return repr(value[: min(LONGEST_TEXT, max(room.text, 0))]) + "\u2026"
    named = _fields(value)
    size = len(value if named is None else named)
    if size > min(LONGEST_LIST, room.items) or depth >= DEEPEST:
        return f"<{kind.__name__} of {size} elements>"
    room.items -= size
    if named is not None:
        return _joined(f"{kind.__qualname__}(", named, ")", room, depth)
    if kind.__repr__ is dict.__repr__:
        pairs = ((f"{text_of(key, room, depth + 1)}: ", part) for key, part in value.items())
        return _joined("{", pairs, "}", room, depth)
    return f"<{kind.__name__} of {size} elements>"


def _joined(
    before: str, pairs: Iterable[tuple[str, Any]], after: str, room: Room, depth: int
) -> str:
    """Join the texts of the parts, until the longest text of a record is reached."""
    parts, length = [], 0
    for name, part in pairs:
        parts.append(name + text_of(part, room, depth + 1))
        length += len(parts[-1])
        if length > LONGEST_TEXT:
            break
    return f"{before}{', '.join(parts)}{after}"


def plain(value: Any, room: Room, depth: int = 0) -> Any:
    """Return `value` as JSON has it, cut to the limits above; see `smachpy.events.to_record`."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int):
        bits = value.bit_length()
        return value if bits <= WIDEST_INT else f"<int of {bits} bits>"
    if isinstance(value, float) and math.isfinite(value):
        return value
    if isinstance(value, str):
        return _cut(value, room)
    try:
        shown = _container(value, room, depth) if depth < DEEPEST else None
    except Exception as error:  # noqa: BLE001  the user's code: show its failure instead
        return f"<{type(value).__name__}: looking at it raised {type(error).__name__}>"
    return _cut(text_of(value, room), room) if shown is None else shown


def _cut(text: str, room: Room) -> str:
    most = min(LONGEST_TEXT, max(room.text, 0))
    room.text -= min(len(text), most)
    return text if len(text) <= most else text[:most] + "\u2026"


def _container(value: Any, room: Room, depth: int) -> Any:
    """Return the JSON form of a container; None if `value` is none, or is too long."""
    if isinstance(value, (list, tuple, dict)):
        if len(value) > min(LONGEST_LIST, room.items):
            return None
        room.items -= len(value)
        if not isinstance(value, dict):
            return [plain(item, room, depth + 1) for item in value]
        pairs = list(value.items())
        if all(isinstance(key, str) for key, _ in pairs):
            room.text -= sum(len(key) for key, _ in pairs)
            return {key[:LONGEST_TEXT]: plain(item, room, depth + 1) for key, item in pairs}
        return None
    return _fields_of(value, room, depth)


def _fields_of(value: Any, room: Room, depth: int) -> Any:
    """Return the fields of a message, or of a ROS time or duration; None for anything else."""
    if hasattr(value, "_md5sum") and hasattr(value, "__slots__"):
        fields = {name: getattr(value, name, None) for name in value.__slots__}
        return {"$msg": str(value._type), "fields": plain(fields, room, depth + 1)}
    if hasattr(value, "to_nsec") and hasattr(value, "nsecs"):
        parts = {"secs": value.secs, "nsecs": value.nsecs}
        return {name: plain(part, room, depth + 1) for name, part in parts.items()}
    return None
