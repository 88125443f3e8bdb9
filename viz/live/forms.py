"""What a form for a goal is made of: the fields of a message, their comments, their defaults.

Numbers are texts in everything that goes to the page: JavaScript cannot hold each of them.
"""

from __future__ import annotations

import math
import re
import textwrap
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import get_message, ros2
from actionlib_core.interfaces._definition import FLOATS, INTEGERS, TIMES
from actionlib_core.interfaces._yaml import quote

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from actionlib_core.exceptions import FieldError
    from actionlib_core.interfaces import Message

WIDE = 96
"""Columns of the YAML: a longer comment goes above its field."""

LEAST_COLUMN = 30  # where comments begin, if there is room
QUATERNION = "geometry_msgs/Quaternion"


def fields_of(cls: type[Message]) -> list[dict[str, Any]]:
    """Return what a form has to know of each field, nested ones included.

    Each has: name, type as it is spelt, base type, comment; `array` (None, or its `length`, None
    for any); `kind` (bool, integer, float, string, time, message); for integers `least` and `most`;
    for constants of its definition that it can take `choices`; for messages `fields`.
    """
    definition = cls._definition
    return [
        {
            "name": one.name,
            "type": str(one.type),
            "base": one.type.base,
            "comment": one.comment,
            "array": {"length": one.type.length} if one.type.is_array else None,
            "choices": _choices(cls, one),
            **_kind(one.type.base),
        }
        for one in definition.fields
    ]


def _class_of(base: str) -> type[Message]:
    """Return the class of a nested type; ROS 2's have their kind in the name."""
    return (ros2.get_message if base.count("/") > 1 else get_message)(base)


def _kind(base: str) -> dict[str, Any]:
    if base in INTEGERS:
        least, most = INTEGERS[base]
        return {"kind": "integer", "least": str(least), "most": str(most)}
    if base in FLOATS:
        return {"kind": "float"}
    if base in {"bool", "string"}:
        return {"kind": base}
    if base in TIMES:
        return {"kind": "time"}
    nested = _class_of(base)
    return {
        "kind": "message",
        "fields": fields_of(nested),
        "about": nested._definition.comment,
        "default": values_of(sensible(nested)),
    }


def _choices(cls: type[Message], field: Any) -> list[dict[str, str]]:
    """The constants meant for a field: those that begin with its name, or all of its type.

    All of its type only where no other field could be meant.
    """
    definition = cls._definition
    same = [c for c in definition.constants if c.type == field.type.base and c.type != "bool"]
    begins = re.sub(r"_?(code|id|type|mode|status)$", "", field.name, flags=re.IGNORECASE).upper()
    named = [c for c in same if begins and c.name.startswith(begins)]
    rivals = [f for f in definition.fields if f.type.base == field.type.base]
    meant = named or (same if len(rivals) == 1 else [])
    return [{"name": c.name, "value": str(c.value), "comment": c.comment} for c in meant]


def sensible(cls: type[Message]) -> Message:
    """Return a message with its default values, and rotations that rotate by nothing.

    The ROS default of a quaternion, all zeros, is no rotation, and servers refuse it.
    """
    message = cls()
    if cls._type == QUATERNION:
        message.w = 1.0  # type: ignore[attr-defined]  # what the type has
        return message
    for one in cls._definition.fields:
        if not one.type.is_builtin and not one.type.is_array:
            setattr(message, one.attribute, sensible(cls._nested[one.type.base]))
    return message


def values_of(message: Message) -> dict[str, Any]:
    """Return the values of a message as a form holds them, numbers and times as text.

    Raises:
        FieldError: values that do not fit their fields.
    """
    plain = message.to_dict()
    return {one.name: _texts(plain[one.name], one.type.base) for one in message._definition.fields}


def _texts(value: Any, base: str) -> Any:
    if isinstance(value, list):
        return [_texts(item, base) for item in value]
    if base in TIMES:
        return _seconds(value)
    if isinstance(value, dict):
        cls = _class_of(base)
        return {f.name: _texts(value[f.name], f.type.base) for f in cls._definition.fields}
    if isinstance(value, (bool, str)):
        return value
    return _number(value)


def _seconds(value: Mapping[str, int]) -> str:
    """A time as seconds, without the rounding of a float."""
    total = value["secs"] * 10**9 + value["nsecs"]
    sign, total = ("-", -total) if total < 0 else ("", total)
    whole, part = divmod(total, 10**9)
    return f"{sign}{whole}.{part:09d}".rstrip("0") + ("0" if part == 0 else "")


def _number(value: float) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return repr(value)


def yaml_of(message: Message) -> str:
    """Return a message as YAML that `from_yaml` reads back, with the comments of its definition."""
    definition = message._definition
    head = [f"# {line}" for line in textwrap.wrap(definition.comment, WIDE - 2)]
    lines = [*head, *_lines(type(message), values_of(message), "")]
    return "\n".join(lines or ["{}  # no fields"]) + "\n"


def _lines(cls: type[Message], values: Mapping[str, Any], indent: str) -> Iterator[str]:
    for one in cls._definition.fields:
        words = "; ".join(filter(None, [_type_words(one.type), one.comment]))
        yield from _entry(f"{indent}{one.name}:", values[one.name], one.type.base, indent, words)
        for choice in _choices(cls, one):
            text = f"{indent}  # {choice['value']}: {choice['name']}"
            yield f"{text} ({choice['comment']})" if choice["comment"] else text


def _type_words(kind: Any) -> str:
    return (
        f"{kind} [s], or now"
        if str(kind) == "time"
        else (f"{kind} [s]" if str(kind) == "duration" else str(kind))
    )


def _entry(head: str, value: Any, base: str, indent: str, words: str) -> Iterator[str]:
    inner = f"{indent}  "
    if isinstance(value, dict):
        cls = _class_of(base)
        yield from _commented(head if value else f"{head} {{}}", words, indent)
        yield from _lines(cls, value, inner)
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        yield from _commented(head, words, indent)
        for item in value:
            first, *others = _lines(_class_of(base), item, f"{inner}  ")
            yield f"{inner}- {first.lstrip()}"
            yield from others
    else:
        yield from _commented(f"{head} {_flow(value, base)}", words, indent)


def _commented(line: str, words: str, indent: str) -> list[str]:
    """A line with its comment behind it, or above it where that would be too wide."""
    padded = f"{line:<{LEAST_COLUMN}}  # {words}"
    if len(padded) <= WIDE:
        return [padded]
    above = textwrap.wrap(words, max(40, WIDE - 2 - len(indent)))
    return [*(f"{indent}# {text}" for text in above), line]


def _flow(value: Any, base: str) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_flow(item, base) for item in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    return quote(value) if base == "string" else str(value)


def problems_of(error: FieldError, type_name: str) -> list[dict[str, str]]:
    """Return the problems of a goal by the path of their field, "" for those of the whole text."""
    found = []
    for problem in error.problems:
        text = problem.removeprefix(f"{type_name}: ")
        path, colon, what = text.partition(": ")
        at_field = bool(colon) and path.startswith("$")
        found.append({"path": path if at_field else "", "text": what if at_field else text})
    return found
