"""Userdata as JSON text: what introspection sends instead of pickles.

Reading it builds data only: numbers, texts, containers, ROS times and messages. No class is
looked up by name except message types, so a text from the network runs no code.

JSON has no word for some Python values; they are objects with one key that begins with `$`:

    {"$tuple": [...]}  {"$set": [...]}  {"$bytes": "base64"}  {"$float": "nan" | "inf" | "-inf"}
    {"$time": [secs, nsecs]}  {"$duration": [secs, nsecs]}
    {"$msg": "pkg/Type", "fields": {...}}       a message
    {"$items": [[key, value], ...]}             a dict whose keys are not plain texts
    {"$repr": "text"}                           a value that only its text is known of
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.time import Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_DEPTH = 40
_SIZED = (str, bytes, bytearray, list, tuple, dict, set, frozenset)


def dumps(values: Mapping[str, Any], *, longest: int | None = None) -> str:
    """Return `values` as JSON text; what has no JSON form becomes a `$repr`.

    Args:
        values: By name.
        longest: Texts, bytes and containers with more elements become a `$repr` of their size, for
            showing; None: everything is written.
    """
    encode = _Encoder(longest).encode
    return json.dumps({key: encode(value, 0) for key, value in values.items()}, allow_nan=False)


def loads(text: str) -> dict[str, Any]:
    """Rebuild the values of a `dumps` text; "" is an empty dict.

    Raises:
        ValueError: The text is no JSON object, or a value in it cannot be rebuilt: a `$repr`, an
            unknown message type, fields that do not fit. Names the place.
    """
    if not text:
        return {}
    try:
        data = json.loads(text)
        if not isinstance(data, dict):
            raise ValueError(f"userdata: got {type(data).__name__}; expected a JSON object.")  # noqa: TRY004
        return {key: _decode(value, f"$.{key}") for key, value in data.items()}
    except RecursionError as error:
        raise ValueError("userdata: nested too deeply.") from error


def find_lost(values: Mapping[str, Any]) -> list[str]:
    """Return the keys whose values `dumps` cannot carry over, in order."""
    return [key for key, value in values.items() if '{"$repr"' in dumps({"_": value})]


class _Encoder:
    """Turns values into what JSON knows; `longest` as in `dumps`."""

    def __init__(self, longest: int | None) -> None:
        self._longest = longest
        self._encoders: tuple[tuple[type | tuple[type, ...], Callable[[Any, int], Any]], ...] = (
            (int, lambda value, _: int(value)),
            (float, _encode_float),
            (list, self._list),
            (tuple, lambda value, depth: {"$tuple": self._list(value, depth)}),
            (dict, self._dict),
            ((set, frozenset), self._set),
            ((bytes, bytearray), lambda value, _: {"$bytes": base64.b64encode(value).decode()}),
            (Time, lambda value, _: {"$time": [value.secs, value.nsecs]}),
            (Duration, lambda value, _: {"$duration": [value.secs, value.nsecs]}),
        )

    def encode(self, value: Any, depth: int) -> Any:
        if value is None or isinstance(value, bool):
            return value
        if self._longest is not None and isinstance(value, _SIZED) and len(value) > self._longest:
            return {"$repr": f"<{type(value).__name__} of {len(value)} elements>"}
        if isinstance(value, str):
            return str(value)
        if depth < _DEPTH:
            for kind, encode in self._encoders:
                if isinstance(value, kind):
                    return encode(value, depth + 1)
            if hasattr(value, "_md5sum") and hasattr(value, "to_dict"):
                return self._message(value, depth)
        return {"$repr": _repr(value)}

    def _dict(self, value: dict[Any, Any], depth: int) -> Any:
        if all(isinstance(key, str) and not key.startswith("$") for key in value):
            return {key: self.encode(item, depth) for key, item in value.items()}
        pairs = value.items()
        return {"$items": [[self.encode(k, depth), self.encode(v, depth)] for k, v in pairs]}

    def _message(self, message: Any, depth: int) -> Any:
        try:
            fields = message.to_dict()
        except ActionlibError:  # a field holds what it cannot carry: show it, do not send it
            return {"$repr": _repr(message)}
        return {"$msg": message._type, "fields": self.encode(fields, depth + 1)}

    def _list(self, value: list[Any] | tuple[Any, ...], depth: int) -> list[Any]:
        return [self.encode(item, depth) for item in value]

    def _set(self, value: set[Any] | frozenset[Any], depth: int) -> Any:
        return {"$set": sorted((self.encode(item, depth) for item in value), key=repr)}


def _encode_float(value: float, _depth: int) -> Any:
    return float(value) if math.isfinite(value) else {"$float": str(float(value))}


def _repr(value: Any) -> str:
    try:
        return repr(value)
    except Exception as error:  # noqa: BLE001  foreign code: its failure is what there is to show
        return f"<{type(value).__name__}: its repr raised {type(error).__name__}>"


def _decode(data: Any, where: str) -> Any:
    if isinstance(data, list):
        return [_decode(item, f"{where}[{i}]") for i, item in enumerate(data)]
    if not isinstance(data, dict):
        return data
    marks = [key for key in data if key.startswith("$")]
    if not marks:
        return {key: _decode(value, f"{where}.{key}") for key, value in data.items()}
    decode = _DECODERS.get(marks[0])
    if decode is None:
        reason = "its sender could only show it" if marks[0] == "$repr" else "unknown"
        raise ValueError(
            f"userdata: {where}: got {data!r}: {reason}; expected one of {sorted(_DECODERS)}."
        )
    try:
        return decode(data, where)
    except (TypeError, ValueError, KeyError, binascii.Error, ActionlibError) as error:
        if isinstance(error, ValueError) and str(error).startswith("userdata: "):
            raise
        raise ValueError(f"userdata: {where}: {error}") from error


def _decode_list(data: Any, where: str) -> list[Any]:
    if not isinstance(data, list):
        raise TypeError(f"got {data!r}; expected a list.")
    return [_decode(item, f"{where}[{i}]") for i, item in enumerate(data)]


def _decode_items(data: dict[str, Any], where: str) -> dict[Any, Any]:
    return dict(_decode_list(data["$items"], where))


def _decode_message(data: dict[str, Any], where: str) -> Any:
    from actionlib_core.interfaces import get_message

    return get_message(data["$msg"]).from_dict(_decode(data["fields"], where))


def _decode_float(data: dict[str, Any], _where: str) -> float:
    return float(data["$float"])


_DECODERS: dict[str, Callable[[dict[str, Any], str], Any]] = {
    "$tuple": lambda data, where: tuple(_decode_list(data["$tuple"], where)),
    "$set": lambda data, where: set(_decode_list(data["$set"], where)),
    "$bytes": lambda data, _: base64.b64decode(data["$bytes"], validate=True),
    "$float": _decode_float,
    "$time": lambda data, _: Time(*data["$time"]),
    "$duration": lambda data, _: Duration(*data["$duration"]),
    "$msg": _decode_message,
    "$items": _decode_items,
}
