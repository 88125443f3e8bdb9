"""Describes messages for the page's goal forms: fields, comments and default values.

Numbers are sent to the page as text: a JavaScript number is a float64, which cannot hold every
64-bit integer.
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
"""Width of the YAML; a comment that would exceed it goes above its field [columns]."""

MIN_COLUMN = 30
"""Comments begin here, or after a longer field [columns]."""
QUATERNION = "geometry_msgs/Quaternion"


def fields_of(cls: type[Message]) -> list[dict[str, Any]]:
    """Return the description of each field, including nested ones.

    Each has `name`, `type` as written, `base` type and `comment`; `array`: None, or its `length`,
    which is None for any length; `choices`: the constants of the definition that are meant for it;
    `kind`: bool, integer, float, string, time or message; `least` and `most` of an integer;
    `fields`, `about` and `default` of a message.
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
    """Return the class of a nested type; a name such as package/msg/Name is one of ROS 2."""
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
    """The constants meant for a field, guessed: definitions do not say.

    They are those whose names begin with the field's name; without any, all of its type, if no
    other field has that type.
    """
    definition = cls._definition
    same = [c for c in definition.constants if c.type == field.type.base and c.type != "bool"]
    # `status_code` with constants STATUS_..., `error_type` with ERROR_...
    begins = re.sub(r"_?(code|id|type|mode|status)$", "", field.name, flags=re.IGNORECASE).upper()
    named = [c for c in same if begins and c.name.startswith(begins)]
    rivals = [f for f in definition.fields if f.type.base == field.type.base]
    meant = named or (same if len(rivals) == 1 else [])
    return [{"name": c.name, "value": str(c.value), "comment": c.comment} for c in meant]


def sensible(cls: type[Message]) -> Message:
    """Return a message with its default values, but with valid quaternions.

    A quaternion's default in ROS, all zeros, is not a rotation, and servers reject it.
    """
    message = cls()
    if cls._type == QUATERNION:
        message.w = 1.0  # type: ignore[attr-defined]  # Quaternion has it
        return message
    for one in cls._definition.fields:
        if not one.type.is_builtin and not one.type.is_array:
            setattr(message, one.attribute, sensible(cls._nested[one.type.base]))
    return message


def values_of(message: Message) -> dict[str, Any]:
    """Return the values of a message for a form, numbers and times as text.

    Raises:
        FieldError: values do not fit their fields.
    """
    plain = message.to_dict()  # checks the values, too
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
    """A time in seconds, exactly: a float has too few digits for nanoseconds since the epoch."""
    total = value["secs"] * 10**9 + value["nsecs"]
    sign, total = ("-", -total) if total < 0 else ("", total)
    whole, part = divmod(total, 10**9)
    return f"{sign}{whole}.{part:09d}".rstrip("0") + ("0" if part == 0 else "")


def _number(value: float) -> str:
    if isinstance(value, float) and not math.isfinite(value):  # as YAML spells them
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    return repr(value)


def yaml_of(message: Message) -> str:
    """Return a message as YAML for `from_yaml`, with the comments of its definition."""
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
            # "- " takes the place of the first line's indentation.
            first, *others = _lines(_class_of(base), item, f"{inner}  ")
            yield f"{inner}- {first.lstrip()}"
            yield from others
    else:
        yield from _commented(f"{head} {_flow(value, base)}", words, indent)


def _commented(line: str, words: str, indent: str) -> list[str]:
    """A line followed by its comment, or with the comment above it if it would be too wide."""
    padded = f"{line:<{MIN_COLUMN}}  # {words}"
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
    """Return the problems of a goal with the paths of their fields, "" for the whole text."""
    found = []
    for problem in error.problems:
        text = problem.removeprefix(f"{type_name}: ")
        path, colon, what = text.partition(": ")
        at_field = bool(colon) and path.startswith("$")
        found.append({"path": path if at_field else "", "text": what if at_field else text})
    return found
