"""Messages as YAML text, in the layout of `rostopic echo`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import FieldError
from actionlib_core.inputs.yaml_text import YamlTextError, load_yaml
from actionlib_core.time import TimeValue

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actionlib_core.interfaces._message import Message

_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t"}
_LARGEST_BMP = 0xFFFF


def dump(message: Message) -> str:
    """Return block-style YAML: two spaces per level, arrays of scalars on one line."""
    return "\n".join(_fields(message, "")) or "{}"


def _fields(message: Message, indent: str) -> list[str]:
    lines: list[str] = []
    for field in message._definition.fields:
        lines += _entry(f"{indent}{field.name}:", getattr(message, field.attribute, None), indent)
    return lines


def _entry(head: str, value: Any, indent: str) -> list[str]:
    inner = indent + "  "
    if isinstance(value, TimeValue):
        return [head, f"{inner}secs: {value.secs}", f"{inner}nsecs: {value.nsecs:>9}"]
    if hasattr(value, "_definition"):
        return [head, *_fields(value, inner)] if value._definition.fields else [f"{head} {{}}"]
    if isinstance(value, (bytes, bytearray)):
        return [f"{head} {list(value)}"]
    if isinstance(value, (list, tuple)):
        return _array(head, list(value), inner)
    return [f"{head} {_scalar(value)}"]


def _array(head: str, values: list[Any], inner: str) -> list[str]:
    if not any(isinstance(v, TimeValue) or hasattr(v, "_definition") for v in values):
        return [f"{head} [{', '.join(map(_scalar, values))}]"]
    lines = [head]
    for value in values:
        body = _entry("", value, inner)
        lines += [f"{inner}-{body[0]}" if len(body) == 1 else f"{inner}-", *body[1:]]
    return lines


def _scalar(value: Any) -> str:
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value):
            return ".nan"
        if math.isinf(value):
            return ".inf" if value > 0 else "-.inf"
        return repr(value)
    return quote(value) if isinstance(value, str) else str(value)


def quote(text: str) -> str:
    """Return a double-quoted YAML string."""
    return f'"{"".join(map(_character, text))}"'


def _character(character: str) -> str:
    """Return a character of a double-quoted YAML string, escaped if necessary."""
    if character in _ESCAPES:
        return _ESCAPES[character]
    if character.isprintable():
        return character
    code = ord(character)
    return f"\\u{code:04x}" if code <= _LARGEST_BMP else f"\\U{code:08x}"


def load(text: str, where: str) -> Mapping[str, Any]:
    """Read a YAML mapping of plain data, without constructing objects. Empty text is {}.

    Raises:
        FieldError: The text is not YAML, or not a mapping.
    """
    try:
        values = load_yaml(text)
    except YamlTextError as error:
        raise FieldError(f"{where}: malformed YAML: {error}") from error
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise FieldError(
            f"{where}: got {values!r}; expected a YAML mapping such as '{{field: value}}'"
        )
    return values
