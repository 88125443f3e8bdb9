"""Userdata as JSON text; introspection sends it instead of SMACH's pickles.

Reading it builds data only: numbers, texts, containers, ROS times and messages. No class is looked
up by name except message types, so a text from the network cannot run code.

Python values that JSON does not have become objects with one key that begins with `$`:

    {"$tuple": [...]}  {"$set": [...]}  {"$bytes": "base64"}  {"$float": "nan" | "inf" | "-inf"}
    {"$time": [secs, nsecs]}  {"$duration": [secs, nsecs]}
    {"$msg": "pkg/Type", "fields": {...}}       a message
    {"$items": [[key, value], ...]}             a dict whose keys are not plain texts
    {"$repr": "text"}                           any other value: only its text is sent
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import json
import math
from functools import partial
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import ActionlibError
from actionlib_core.inputs.json_text import JsonTextError, load_json
from actionlib_core.time import Duration, Time
from smachpy.userdata.secret import masked
from smachpy.userdata.shown import literal

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

_DEPTH = 40
_NESTED = (list, tuple, dict, set, frozenset)
_SIZED = (str, bytes, bytearray, *_NESTED)
_AGAIN = 10_000
"""Number of containers of containers that are written again in one text."""


def dumps(values: Mapping[str, Any], *, longest: int | None = None) -> str:
    """Return `values` as JSON text; values without a JSON form become a `$repr`.

    Args:
        values: Name -> value.
        longest: Texts, bytes and containers with more elements become a `$repr` of their size, for
            display; None to write everything that is not written again and again.
    """
    if longest is not None:  # for display
        values = {key: masked(value, key) for key, value in values.items()}
    text = _Text(longest)
    encoded = {key: _encode(value, text, 0) for key, value in values.items()}
    return json.dumps(encoded, allow_nan=False)


def encoded(value: Any) -> Any:
    """Return a value as `dumps` writes it, before it becomes text."""
    return _encode(value, _Text(None), 0)


def decoded(value: Any, where: str) -> Any:
    """Return the value of an `encoded` one; `where` is its place, for errors.

    Raises:
        ValueError: it has no such form, or was only shown.
    """
    return _decode(value, where)


def from_shown(values: Mapping[str, Any]) -> str:
    """Return JSON text, as `dumps` does, of values as records of events have them (`shown`)."""
    return json.dumps({key: _of_shown(value) for key, value in values.items()})


def _of_shown(value: Any) -> Any:
    if isinstance(value, list):
        return [_of_shown(item) for item in value]
    if not isinstance(value, dict):
        return value
    if "$int" in value:
        return int(value["$int"])
    if any(mark in value for mark in ("$object", "$array", "$cut", "$large", "$repr")):
        return {"$repr": literal(value)}
    return {key: _of_shown(item) for key, item in value.items()}


def loads(text: str) -> dict[str, Any]:
    """Rebuild the values of a `dumps` text; "" is an empty dict.

    Raises:
        ValueError: The text is not a JSON object, or a value in it cannot be rebuilt: a `$repr`, an
            unknown message type, wrong fields. The text names the place.
    """
    if not text:
        return {}
    try:
        data = load_json(text, deepest=4 * _DEPTH)  # three for a level of `$items`
        if not isinstance(data, dict):
            raise ValueError(f"userdata: got {type(data).__name__}; expected a JSON object.")  # noqa: TRY004
        return {key: _decode(value, f"$.{key}") for key, value in data.items()}
    except JsonTextError as error:
        raise ValueError(f"userdata: {error}.") from error


def find_lost(values: Mapping[str, Any]) -> list[str]:
    """Return, in order, the keys of values that `dumps` cannot represent."""
    return [key for key, value in values.items() if '{"$repr"' in dumps({"_": value})]


class _Text:
    """One text that is made.

    Args:
        longest: As in `dumps`.
    """

    __slots__ = ("_again", "_seen", "longest")

    def __init__(self, longest: int | None) -> None:
        self.longest = longest
        self._seen: set[int] = set()
        self._again = 0

    def is_too_large(self, value: Any, depth: int) -> bool:
        """Return whether only the size of a value is shown.

        A value that several others hold is written in each of them. Where places know their
        neighbours, as on a map of roads, there are more ways to each than anybody can write.
        """
        if self.longest is not None and len(value) > self.longest:
            return True
        if not isinstance(value, _NESTED):
            return False
        if depth >= _DEPTH:
            return True
        if id(value) not in self._seen:
            self._seen.add(id(value))
        elif any(isinstance(one, _NESTED) for one in _parts(value)):
            self._again += 1
        return self._again > _AGAIN


def _parts(value: Any) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value


def _encode(value: Any, text: _Text, depth: int) -> Any:
    """Return the JSON form of a value, as a part of a text."""
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, _SIZED) and text.is_too_large(value, depth):
        return {"$repr": f"<{type(value).__name__} of {len(value)} elements>"}
    if isinstance(value, str):
        return str(value)
    if depth < _DEPTH:
        inside = partial(_encode, text=text, depth=depth + 1)
        for kind, encode in _ENCODERS:
            if isinstance(value, kind):
                return encode(value, inside)
        if hasattr(value, "_md5sum") and hasattr(value, "to_dict"):
            with contextlib.suppress(ActionlibError):  # a field has an invalid value: send its repr
                fields = _encode(value.to_dict(), _Text(text.longest), depth + 1)
                return {"$msg": value._type, "fields": fields}
    return {"$repr": _repr(value)}


def _encode_dict(value: dict[Any, Any], inside: Callable[[Any], Any]) -> Any:
    if all(isinstance(key, str) and not key.startswith("$") for key in value):
        return {key: inside(item) for key, item in value.items()}
    return {"$items": [[inside(key), inside(item)] for key, item in value.items()]}


# Pairs (class, encoder), tried in this order; subclasses are encoded as their base class. Sets are
# sorted, so that equal userdata gives equal text and is not sent again.
_ENCODERS: tuple[tuple[Any, Callable[[Any, Callable[[Any], Any]], Any]], ...] = (
    (int, lambda value, _: int(value)),
    (float, lambda x, _: float(x) if math.isfinite(x) else {"$float": str(float(x))}),
    (list, lambda value, inside: [inside(item) for item in value]),
    (tuple, lambda value, inside: {"$tuple": [inside(item) for item in value]}),
    (dict, _encode_dict),
    ((set, frozenset), lambda value, inside: {"$set": sorted(map(inside, value), key=repr)}),
    ((bytes, bytearray), lambda value, _: {"$bytes": base64.b64encode(value).decode()}),
    (Time, lambda value, _: {"$time": [value.secs, value.nsecs]}),
    (Duration, lambda value, _: {"$duration": [value.secs, value.nsecs]}),
)


def _repr(value: Any) -> str:
    try:
        return repr(value)
    except Exception as error:  # noqa: BLE001  the user's code: show its failure instead
        return f"<{type(value).__name__}: its repr raised {type(error).__name__}>"


def _decode(data: Any, where: str) -> Any:
    if isinstance(data, list):
        return _decode_list(data, where)
    if not isinstance(data, dict):
        return data
    # `dumps` writes a dict with a key that begins with `$` as `$items`, so these are marks only.
    marks = [key for key in data if key.startswith("$")]
    if not marks:
        return {key: _decode(value, f"{where}.{key}") for key, value in data.items()}
    decode = _DECODERS.get(marks[0])
    if decode is None:
        reason = "its sender could only show it" if marks[0] == "$repr" else "unknown"
        raise ValueError(
            f"userdata: {where}: got {data!r} ({reason}); expected one of {sorted(_DECODERS)}."
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


def _decode_message(data: dict[str, Any], where: str) -> Any:
    from actionlib_core.interfaces import get_message

    return get_message(data["$msg"]).from_dict(_decode(data["fields"], where))


_DECODERS: dict[str, Callable[[dict[str, Any], str], Any]] = {
    "$tuple": lambda data, where: tuple(_decode_list(data["$tuple"], where)),
    "$set": lambda data, where: set(_decode_list(data["$set"], where)),
    "$items": lambda data, where: dict(_decode_list(data["$items"], where)),
    "$bytes": lambda data, _: base64.b64decode(data["$bytes"], validate=True),
    "$float": lambda data, _: float(data["$float"]),
    "$time": lambda data, _: Time(*data["$time"]),
    "$duration": lambda data, _: Duration(*data["$duration"]),
    "$msg": _decode_message,
}
