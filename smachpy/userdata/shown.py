"""Values for display: their structure as JSON has it, within limits, and their text for people.

JSON's own values stand for themselves: numbers, texts, lists, and dicts whose keys are texts that
do not begin with "$". Any other value is an object with one of these keys:

    {"$tuple": [...]}  {"$set": [...]}
    {"$items": [[key, value], ...]}            a dict with other keys
    {"$float": "nan" | "inf" | "-inf"}
    {"$int": "12345678901234567890"}           an integer that JavaScript would round
    {"$bytes": "base64"}
    {"$msg": "pkg/Type", "fields": {...}}      a message of ROS
    {"$object": "Pose2D", "fields": {...}}     a dataclass, named tuple, time of ROS, ...
    {"$array": [...], "dtype": "float64"}      an array of numpy
    {"$cut": "the beginning", "length": 9999}  a text that is too long
    {"$large": "list", "length": 9999}         a value with too many parts: only their number
    {"$repr": "..."}                           any other value: its `repr`, perhaps cut

`literal` makes the text of such a value, as Python writes it.

`repr` has no limit, so the parts of a value are counted before it is called. That works for
Python's containers, messages, dataclasses, namespaces and exceptions, and for anything with a
length; the `__repr__` of any other class is called without a check.
"""

from __future__ import annotations

import binascii
import math
from collections import UserDict, UserList, deque
from collections.abc import Callable, ItemsView, KeysView, ValuesView
from enum import Enum
from functools import partial
from itertools import chain
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from smachpy.userdata.secret import MASK, hides, is_secret, masked

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_TEXT_LENGTH = 4_000
MAX_LIST_ITEMS = 1_000
MAX_NESTING = 20
MAX_TOTAL_ITEMS = 10_000
MAX_TOTAL_TEXT = 100_000
WIDEST_INT = 1_024  # bits
EXACT = 2**53  # integers up to here are exact in JavaScript
"""Limits of values in a record, which are for display, not for computing.

The first three apply to each part, the next two to a whole record, so that making one takes a few
milliseconds at most.
"""

_MAX_REPR_LENGTH = 4 * MAX_TEXT_LENGTH  # characters in the parts of a `repr`, which is then cut
_MAX_REPR_NESTING = 100
_ROUNDED = 6  # digits of a number in a line of text, as on the page
_SMALL = frozenset({type(None), bool, float, complex, range, type})
_MAPPINGS = (dict, UserDict, MappingProxyType)
_LISTS = (list, tuple, set, frozenset, deque, UserList, KeysView, ValuesView, ItemsView)


class Room:
    """The remaining room in a record; `above` has the ids of the values around the present one."""

    def __init__(self, items: int = MAX_TOTAL_ITEMS, text: int = MAX_TOTAL_TEXT) -> None:
        self.items = items
        self.text = text
        self.above: set[int] = set()


def text_of(value: Any, room: Room, depth: int = 0) -> str:
    """Return `repr(value)`, or a text with only the sizes of parts that are too large.

    It may be longer than the room for text: the caller cuts it. Each visited part reduces the room
    for items. If the value's own code raises, the text says so.
    """
    try:
        left = Room(room.items, min(room.text, _MAX_REPR_LENGTH))
        fits = _fits(value, left, set())
        spent = room.items - max(left.items, 0)
        room.items -= spent if fits else spent // 4  # counting costs less than formatting
        return repr(masked(value)) if fits else _outline(value, room, depth)
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
        return left.text >= 0 and (isinstance(value, str) or len(value) <= MAX_LIST_ITEMS)
    size = _size(value)
    if size is not None and size > min(MAX_LIST_ITEMS, left.items):
        return False
    # `above` has the ids of the values around this one: Python's `repr` shows a cycle as "...", so
    # it adds nothing here.
    inside = _inside(value)
    return inside is None or id(value) in above or _all_fit(inside, left, {*above, id(value)})


def _all_fit(inside: Iterable[Any], left: Room, above: set[int]) -> bool:
    if len(above) > _MAX_REPR_NESTING:
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
        from dataclasses import fields

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
        return repr(value[: min(MAX_TEXT_LENGTH, max(room.text, 0))]) + "\u2026"
    named = _fields(value)
    size = len(value if named is None else named)
    if size > min(MAX_LIST_ITEMS, room.items) or depth >= MAX_NESTING:
        return f"<{kind.__name__} of {size} elements>"
    room.items -= size
    if named is not None:
        plain = [(name, MASK if hides(name[:-1], part) else part) for name, part in named]
        return _joined(f"{kind.__qualname__}(", plain, ")", room, depth)
    if kind.__repr__ is dict.__repr__:
        pairs = (
            (f"{text_of(key, room, depth + 1)}: ", MASK if hides(key, part) else part)
            for key, part in value.items()
        )
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
        if length > MAX_TEXT_LENGTH:
            break
    return f"{before}{', '.join(parts)}{after}"


def shown(value: Any, room: Room, depth: int = 0) -> Any:
    """Return the structure of a value, cut to the limits above."""
    kind = type(value)
    if value is None or kind is bool:
        return value
    try:
        return _shown_atom(value, room) if kind in _ATOMS else _shown(value, room, depth)
    except Exception as error:  # noqa: BLE001  the user's code: show its failure instead
        return {"$repr": f"<{type(value).__name__}: looking at it raised {type(error).__name__}>"}


_ATOMS: Final = frozenset({int, float, str, bytes})


def _shown(value: Any, room: Room, depth: int) -> Any:  # noqa: PLR0911  one for each kind
    kind = type(value)
    usual = _USUAL.get(kind)
    if usual is not None:
        return _shown_parts(usual, len(value), value, room, depth)
    if is_secret(value):
        return {"$repr": MASK}
    if hasattr(kind, "_md5sum") and hasattr(kind, "__slots__"):
        return _shown_parts(_shown_message, len(kind.__slots__), value, room, depth)
    if isinstance(value, Enum):
        return {"$repr": _cut(f"{kind.__qualname__}.{value.name}", room)}
    if isinstance(value, (int, float, str, bytes, bytearray)):
        return _shown_atom(value, room)
    form, size = _form(kind, value)
    if form is None:
        return {"$repr": _cut(text_of(value, room), room)}
    return _shown_parts(form, size, value, room, depth)


_Form: TypeAlias = "Callable[[Any, Room, int], Any]"


def _shown_parts(form: _Form, size: int, value: Any, room: Room, depth: int) -> Any:
    if id(value) in room.above:
        return {"$repr": "..."}  # as Python writes a value inside itself
    if size > min(MAX_LIST_ITEMS, room.items) or depth >= MAX_NESTING or room.text <= 0:
        return {"$large": type(value).__name__, "length": size}
    room.items -= size
    room.above.add(id(value))
    try:
        return form(value, room, depth + 1)
    finally:
        room.above.discard(id(value))


def _shown_atom(value: Any, room: Room) -> Any:
    if isinstance(value, str):
        most = min(MAX_TEXT_LENGTH, max(room.text, 0))
        room.text -= min(len(value), most)
        whole = len(value) <= most
        return str(value) if whole else {"$cut": str(value[:most]), "length": len(value)}
    if isinstance(value, bytes | bytearray):
        if len(value) > min(MAX_LIST_ITEMS, room.text):
            return {"$large": type(value).__name__, "length": len(value)}
        room.text -= len(value)
        return {"$bytes": binascii.b2a_base64(value, newline=False).decode("ascii")}
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"$float": str(float(value))}
    if abs(value) <= EXACT:
        return int(value)
    bits = value.bit_length()
    return {"$int": str(int(value))} if bits <= WIDEST_INT else {"$repr": f"<int of {bits} bits>"}


def _form(kind: Any, value: Any) -> tuple[_Form | None, int]:
    """Return the function that makes the structure of an unusual container; None for others."""
    if isinstance(value, MappingProxyType | UserDict | dict):
        return _shown_dict, len(value)
    if hasattr(kind, "dtype") and hasattr(kind, "tolist"):
        is_number = value.shape == ()
        return (_shown_number if is_number else _shown_array), int(value.size)
    if (found := _named(kind, value)) is not None:
        return partial(_shown_object, found), len(found)
    for base, form in _USUAL.items():
        if isinstance(value, base):
            return form, len(value)
    return None, 0


def _named(kind: Any, value: Any) -> dict[str, Any] | None:
    """Return the named parts of a value that its class declares; None if it declares none."""
    if hasattr(kind, "to_nsec") and hasattr(kind, "nsecs"):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if hasattr(kind, "__dataclass_fields__"):
        from dataclasses import fields

        return {one.name: getattr(value, one.name, None) for one in fields(value) if one.repr}
    if issubclass(kind, tuple) and hasattr(kind, "_fields"):
        return dict(zip(kind._fields, value, strict=False))
    if issubclass(kind, SimpleNamespace):
        return dict(vars(value))
    if hasattr(kind, "__attrs_attrs__"):
        return {o.name: getattr(value, o.name, None) for o in kind.__attrs_attrs__ if o.repr}
    return None


def _shown_message(value: Any, room: Room, depth: int) -> Any:
    named = {name: getattr(value, name, None) for name in type(value).__slots__}
    return {"$msg": str(value._type), "fields": _shown_fields(named, room, depth)}


def _shown_object(named: dict[str, Any], value: Any, room: Room, depth: int) -> Any:
    name = type(value).__qualname__.rpartition(".")[2]
    return {"$object": name, "fields": _shown_fields(named, room, depth)}


def _shown_fields(named: dict[str, Any], room: Room, depth: int) -> dict[str, Any]:
    return {str(key): _shown_named(key, part, room, depth) for key, part in named.items()}


def _shown_named(name: object, value: Any, room: Room, depth: int) -> Any:
    return {"$repr": MASK} if hides(name, value) else shown(value, room, depth)


def _shown_list(value: Any, room: Room, depth: int) -> Any:
    return [shown(item, room, depth) for item in value]


def _shown_dict(value: Any, room: Room, depth: int) -> Any:
    pairs = list(value.items())
    if all(isinstance(key, str) and key[:1] != "$" for key, _ in pairs):
        room.text -= sum(len(key) for key, _ in pairs)
        return {
            str(key[:MAX_TEXT_LENGTH]): _shown_named(key, item, room, depth) for key, item in pairs
        }
    return {
        "$items": [
            [shown(key, room, depth), _shown_named(key, item, room, depth)] for key, item in pairs
        ]
    }


def _shown_array(value: Any, room: Room, depth: int) -> Any:
    return {"$array": shown(value.tolist(), room, depth), "dtype": str(value.dtype)}


def _shown_number(value: Any, room: Room, depth: int) -> Any:
    return shown(value.item(), room, depth)


_USUAL: Final[dict[Any, _Form]] = {
    list: _shown_list,
    dict: _shown_dict,
    tuple: lambda value, room, depth: {"$tuple": _shown_list(value, room, depth)},
    set: lambda value, room, depth: {"$set": _shown_list(value, room, depth)},
    frozenset: lambda value, room, depth: {"$set": _shown_list(value, room, depth)},
}


def _cut(text: str, room: Room) -> str:
    most = min(MAX_TEXT_LENGTH, max(room.text, 0))
    room.text -= min(len(text), most)
    return text if len(text) <= most else text[:most] + "\u2026"


def short_text(text: str, room: Room) -> str:
    """Return a text, cut to the limits above; "\u2026" at the end shows that it was cut."""
    return _cut(text, room)


# -- the text of a value ---------------------------------------------------------------------------


def literal(value: Any) -> str:
    """Return a value of `shown` as Python writes it.

    Values of other forms, as of damaged recordings, are shown as they are.
    """
    if isinstance(value, dict):
        for mark, text in _LITERALS.items():
            if mark in value:
                try:
                    return text(value)
                except (TypeError, ValueError, LookupError, AttributeError):
                    break
        return "{" + ", ".join(f"{key!r}: {literal(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list):
        return f"[{_listed(value)}]"
    return repr(value)


def brief(value: Any) -> str:
    """Return a value of `shown` as `literal` does, with rounded numbers, for a line of text.

    Binary fractions have up to 17 digits (1.5708000000000002), which nobody reads.
    """
    return literal(_rounded(value))


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.{_ROUNDED}g}")
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    return value


def _listed(values: Iterable[Any]) -> str:
    return ", ".join(map(literal, values))


def _tuple_text(value: dict[str, Any]) -> str:
    items = value["$tuple"]
    return f"({_listed(items)},)" if len(items) == 1 else f"({_listed(items)})"


def _call_text(value: dict[str, Any]) -> str:
    name = value.get("$object") or value["$msg"].rpartition("/")[2]
    named = ", ".join(f"{key}={literal(part)}" for key, part in value["fields"].items())
    return f"{name}({named})"


_LITERALS: Final[dict[str, Callable[[dict[str, Any]], str]]] = {
    "$tuple": _tuple_text,
    "$set": lambda value: f"{{{_listed(value['$set'])}}}" if value["$set"] else "set()",
    "$items": lambda value: (
        "{" + ", ".join(f"{literal(key)}: {literal(part)}" for key, part in value["$items"]) + "}"
    ),
    "$float": lambda value: str(value["$float"]),
    "$int": lambda value: str(value["$int"]),
    "$bytes": lambda value: repr(binascii.a2b_base64(value["$bytes"])),
    "$msg": _call_text,
    "$object": _call_text,
    "$array": lambda value: f"array({literal(value['$array'])}, dtype={value['dtype']})",
    "$cut": lambda value: f"{value['$cut']!r}\u2026",
    "$large": lambda value: f"<{value['$large']} of {value['length']} elements>",
    "$repr": lambda value: str(value["$repr"]),
}


def fields_of(value: Any) -> dict[str, Any] | None:
    """Return the named parts of a value of `shown`; None if it has none."""
    if not isinstance(value, dict):
        return None
    if "$msg" in value or "$object" in value:
        parts = value.get("fields")
        return parts if isinstance(parts, dict) else {}
    return {} if is_shown(value) else value


def is_shown(value: Any) -> bool:
    """Return whether a value is of `shown` and has a form that JSON alone does not have."""
    return isinstance(value, dict) and any(mark in value for mark in _LITERALS)


def shortened_part(value: Any) -> Any:
    """Return the first part of a value of `shown` of which something was left out; else None."""
    if isinstance(value, list):
        return next((part for one in value if (part := shortened_part(one)) is not None), None)
    if not isinstance(value, dict):
        return None
    is_cut = "$cut" in value or "$large" in value
    if is_cut or str(value.get("$repr", "")).endswith("\u2026"):
        return value
    return shortened_part(list(value.values()))
