"""Userdata values as JSON for the journal, and back without loss.

Decoding only builds data. Classes are looked up among the registered ones and never imported by
name, so a journal from elsewhere cannot run code that the mission does not use.

Values that JSON lacks are objects whose first key begins with `$`:

    {"$tuple": [...]}  {"$set": [...]}  {"$frozenset": [...]}  {"$items": [[key, value], ...]}
    {"$bytes": "base64"}  {"$bytearray": "base64"}  {"$float": "nan" | "inf" | "-inf"}
    {"$int": "0x..."}  {"$time": [secs, nsecs]}  {"$duration": [secs, nsecs]}       of ROS
    {"$datetime": "ISO 8601", "zone": "Europe/Berlin"}  {"$date"} {"$clock"} {"$timedelta"}
    {"$path": "text"}  {"$purepath": "text"}
    {"$msg": "pkg/Type", "sum": "md5", "fields": {...}}
    {"$ros2": "pkg/msg/Type", "distro": ..., "sum": "RIHS01", "fields": {...}}
    {"$array": "base64", "dtype": ..., "shape": [...]}  {"$scalar": "base64", "dtype": ...}
    {"$type": "module:Class", "fields": {...}}  {"$enum": "module:Class", "name": "RED"}
    {"$custom": "module:Class", "data": ...}
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import enum
import json
import math
import sys
from datetime import date, datetime, time, timedelta, timezone
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Final
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from actionlib_core.exceptions import ActionlibError
from actionlib_core.time import Duration, Time
from smachpy.exceptions import (
    InvalidUserCodeError,
    MissionError,
    did_you_mean,
)
from smachpy.userdata.kept_types import (
    REGISTERED,
    RegisteredType,
    is_named_tuple,
    name_of,
    problem_of,
)
from smachpy.userdata.readonly import writable
from smachpy.userdata.secret import hides, is_secret

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


_MAX_NESTING: Final = 100


class NotDurableError(InvalidUserCodeError, TypeError):
    """A value cannot be kept in a journal.

    Try: keep plain data in the userdata, register the type, or list the key as `transient`.

    Attributes:
        key: The userdata key.
        place: The place in its value, ".route[3].socket", or "" for the value itself.
        kind: The type of the value at that place.
        reason: Why it cannot be kept.
    """

    def __init__(
        self, key: str, place: str, kind: type, reason: str, way_out: str, *, path: str = ""
    ) -> None:
        self.key = key
        self.place = place
        self.kind = kind
        self.reason = reason
        where = f"{path}: " if path else ""
        super().__init__(
            f"{where}userdata key {key!r}: got {kind.__module__}.{kind.__qualname__}"
            f"{f' at {place}' if place else ''}, which a journal cannot keep ({reason}); expected "
            f"{way_out}, or transient=[{key!r}] if it does not have to survive.",
            path=path,
        )


class JournalValueError(MissionError, ValueError):
    """A value in a journal cannot be read back.

    Try: restore the class or the registration with which the value was written.

    Attributes:
        place: Its place in the encoded value, "$.route[3]".
        reason: Why it cannot be read.
    """

    def __init__(self, place: str, reason: str) -> None:
        self.place = place
        self.reason = reason
        super().__init__(f"journal: {place}: {reason}")


def encode(value: Any, *, key: str = "", path: str = "") -> Any:
    """Return a value in a form that `json` can write.

    The result shares no mutable object with `value`.

    Args:
        value: A userdata value; of a read-only view, the value behind it is kept.
        key: Its key, for errors.
        path: The path of the state that sets it, for errors.

    Raises:
        NotDurableError: the value, or something in it, cannot be kept.
    """
    try:
        return _encode(value, "", 0)
    except _Refused as refused:
        place, kind, reason, way_out = refused.args
        cause = refused.__cause__
        error = NotDurableError(key, place, kind, reason, way_out, path=path)
    raise error from cause


def decode(data: Any) -> Any:
    """Rebuild the value of an `encode` result.

    Raises:
        JournalValueError: it names a class that is not registered, or the data do not fit.
    """
    try:
        return _decode(data, "$")
    except RecursionError:
        raise JournalValueError(
            "$", "got data nested too deeply; expected an encoded value."
        ) from None


class _Refused(Exception):  # noqa: N818  never leaves this module
    """Arguments: place, type, reason, way out."""


_ATOMS: Final = frozenset({type(None), bool, int, str})
_NUMBERS: Final = _ATOMS | {float}
_SIZED: Final = (str, bytes, bytearray, list, tuple, dict, set, frozenset)
_LARGEST: Final = 2**4096
"""Larger integers are kept as hexadecimal text: CPython refuses to convert integers of more than
4300 decimal digits (`sys.set_int_max_str_digits`), hexadecimal ones have no limit.
"""


def _encode(value: Any, place: str, depth: int) -> Any:
    # The exact type, not `isinstance`: a subclass of str or int would come back as a plain one.
    kind = type(value)
    if kind in _ATOMS and (kind is not int or -_LARGEST < value < _LARGEST):
        return value
    # A value that contains itself would end in a RecursionError far away from its place.
    if depth > _MAX_NESTING:
        reason = "it is nested too deeply"
        raise _Refused(f"{place[:60]}...", kind, reason, "one that does not contain itself")
    encoder = _ENCODERS.get(kind)
    if encoder is not None:
        return encoder(value, place, depth)
    registered = REGISTERED.get(name_of(kind))
    if registered is not None and registered.kind is kind:
        return _encode_registered(value, registered, place, depth)
    shown = writable(value)
    if shown is not value:
        return _encode(shown, place, depth + 1)
    special = _encode_message(value, place, depth) or _encode_numpy(value, place)
    if special is None:
        raise _Refused(place, kind, *_why_not(kind))
    return special


def _why_not(kind: type) -> tuple[str, str]:
    """Return the reason, and what to use instead."""
    if getattr(kind, "_smachpy_secret", False) is True:
        return "it is a secret", "it as the value of a userdata key of its own, which is not kept"
    name = kind.__qualname__
    same_name = REGISTERED.get(name_of(kind))
    if "<locals>" in name:
        return "its class is made inside a function", "a class of a module"
    if same_name is not None or problem_of(kind) is None:
        return "its class is not registered", f"smachpy.register_type({name})"
    for base in kind.__mro__[1:]:
        if base in _ENCODERS or base is str:
            return f"it is a subclass of {base.__name__}", f"a plain {base.__name__}"
    return (
        "its class is no dataclass, enum or message",
        f"smachpy.register_type({name}, to_data=..., from_data=...)",
    )


def _encode_list(value: list[Any], place: str, depth: int) -> Any:
    # Long lists, such as laser scans, hold only numbers: no text for the place of each item.
    if _NUMBERS.issuperset(map(type, value)):
        return [_encode(item, place, depth) for item in value]
    return [_encode(item, f"{place}[{i}]", depth + 1) for i, item in enumerate(value)]


def _encode_dict(value: dict[Any, Any], place: str, depth: int) -> Any:
    # Other keys, and texts that look like one of the marks above, are kept as pairs.
    if all(type(key) is str and not key.startswith("$") for key in value):
        return {key: _encode_named(key, item, place, depth) for key, item in value.items()}
    items = value.items()
    pairs = [
        [
            _encode(key, f"{place} key {key!r}", depth + 1),
            _encode_named(key, item, place, depth),
        ]
        for key, item in items
    ]
    return {"$items": pairs}


def is_named_secret(name: object, value: object) -> bool:
    """Return whether a value is a secret by its name, in clear; nothing, as "", is none."""
    is_empty = isinstance(value, _SIZED) and not value
    return hides(name, value) and not is_empty and not is_secret(value)


def _encode_named(name: object, value: Any, place: str, depth: int) -> Any:
    """Encode a value with a name; one that its name calls a secret is refused in clear."""
    inside = f"{place}.{name}" if isinstance(name, str) else f"{place}[{name!r}]"
    if is_named_secret(name, value):
        raise _Refused(
            inside,
            type(value),
            "its name says that it is a secret",
            "a userdata key of its own with a smachpy.Secret, which is not kept, or another name",
        )
    return _encode(value, inside, depth + 1)


def _sequence(mark: str) -> Callable[[Any, str, int], Any]:
    def encode_sequence(value: Iterable[Any], place: str, depth: int) -> Any:
        items = [_encode(item, f"{place}[{i}]", depth + 1) for i, item in enumerate(value)]
        # The recorder compares texts to find changed values; equal sets must give equal texts.
        if mark != "$tuple":
            items.sort(key=lambda item: json.dumps(item, sort_keys=True))
        return {mark: items}

    return encode_sequence


def _encode_datetime(value: datetime, place: str, _: int) -> Any:
    zone = value.tzinfo
    if zone is None or type(zone) is timezone:
        return {"$datetime": value.isoformat(), "fold": value.fold}
    if isinstance(zone, ZoneInfo) and zone.key:
        return {
            "$datetime": value.replace(tzinfo=None).isoformat(),
            "fold": value.fold,
            "zone": zone.key,
        }
    raise _Refused(f"{place}.tzinfo", type(zone), "its rules have no name", "a ZoneInfo")


def _encode_time(value: time, place: str, _: int) -> Any:
    if value.tzinfo is None or type(value.tzinfo) is timezone:
        return {"$clock": value.isoformat(), "fold": value.fold}
    reason = "its offset depends on a date"
    raise _Refused(f"{place}.tzinfo", type(value.tzinfo), reason, "a time without a zone")


def _base64(value: Any) -> str:
    return base64.b64encode(value).decode()


_ENCODERS: Final[dict[type, Callable[[Any, str, int], Any]]] = {
    int: lambda value, *_: {"$int": hex(value)},  # only larger than `_LARGEST`
    float: lambda value, *_: value if math.isfinite(value) else {"$float": str(value)},
    list: _encode_list,
    dict: _encode_dict,
    tuple: _sequence("$tuple"),
    set: _sequence("$set"),
    frozenset: _sequence("$frozenset"),
    bytes: lambda value, *_: {"$bytes": _base64(value)},
    bytearray: lambda value, *_: {"$bytearray": _base64(value)},
    Time: lambda value, *_: {"$time": [value.secs, value.nsecs]},
    Duration: lambda value, *_: {"$duration": [value.secs, value.nsecs]},
    datetime: _encode_datetime,
    date: lambda value, *_: {"$date": value.isoformat()},
    time: _encode_time,
    timedelta: lambda value, *_: {"$timedelta": [value.days, value.seconds, value.microseconds]},
    type(Path()): lambda value, *_: {"$path": str(value)},
    PurePosixPath: lambda value, *_: {"$purepath": str(value)},
}


def _encode_registered(value: Any, registered: RegisteredType, place: str, depth: int) -> Any:
    kind = registered.kind
    name = name_of(kind)
    if registered.to_data is not None:
        try:
            data = registered.to_data(value)
        except Exception as error:
            raise _Refused(
                place, kind, f"its to_data raised {error!r}", "one that works"
            ) from error
        return {"$custom": name, "data": _encode(data, f"{place}.to_data()", depth + 1)}
    if isinstance(value, enum.Enum):
        if value.name in kind.__members__:  # type: ignore[attr-defined]  # an enum has them
            return {"$enum": name, "name": value.name}
        # A combination of flags (`enum.Flag`) has no name of its own.
        return {"$enum": name, "value": _encode(value.value, f"{place}.value", depth + 1)}
    if isinstance(value, tuple):
        names: Iterable[str] = value._fields  # type: ignore[attr-defined]
    else:
        names = [field.name for field in dataclasses.fields(value)]
    fields = {}
    for field in names:
        try:
            inner = getattr(value, field)
        except AttributeError as error:
            raise _Refused(
                f"{place}.{field}", kind, "this field is not set", "all of them"
            ) from error
        fields[field] = _encode_named(field, inner, place, depth)
    return {"$type": name, "fields": fields}


def _encode_message(value: Any, place: str, depth: int) -> Any:
    """Return the fields of a message without converting or checking them as for sending."""
    kind = type(value)
    wire = getattr(kind, "_wire", None)
    if wire is None or not hasattr(kind, "_slot_types"):
        return None
    fields = {
        slot: _encode_named(slot, getattr(value, slot), place, depth) for slot in kind.__slots__
    }
    name = kind._type
    if wire == "ros2":
        return {"$ros2": name, "distro": kind._distro, "sum": kind._rihs01, "fields": fields}
    return {"$msg": name, "sum": kind._md5sum, "fields": fields}


def _encode_numpy(value: Any, place: str) -> Any:
    numpy = sys.modules.get("numpy")  # NumPy is optional; without it there are no arrays
    if numpy is None:
        return None
    kind = type(value)
    if kind is not numpy.ndarray and not isinstance(value, numpy.generic):
        return None
    if value.dtype.hasobject:
        raise _Refused(place, kind, "it holds Python objects", "an array of numbers")
    described = numpy.lib.format.dtype_to_descr(value.dtype)
    dtype = described if isinstance(described, str) else _encode(described, place, 0)
    data = _base64(numpy.ascontiguousarray(value).tobytes())
    if kind is numpy.ndarray:
        return {"$array": data, "dtype": dtype, "shape": list(value.shape)}
    return {"$scalar": data, "dtype": dtype}


def _decode(data: Any, place: str) -> Any:
    if isinstance(data, list):
        return [_decode(item, f"{place}[{i}]") for i, item in enumerate(data)]
    if not isinstance(data, dict):
        return data
    mark = next(iter(data), "")
    if not mark.startswith("$"):
        return {key: _decode(value, f"{place}.{key}") for key, value in data.items()}
    decoder = _DECODERS.get(mark)
    if decoder is None:
        raise JournalValueError(place, f"got {mark!r}; expected one of {sorted(_DECODERS)}.")
    try:
        return decoder(data, place)
    except JournalValueError:
        raise
    except (
        TypeError,
        ValueError,
        KeyError,
        AttributeError,
        binascii.Error,
        ActionlibError,
    ) as error:
        reason = f"got {mark!r} with unusable data: {error!r}."
        raise JournalValueError(place, reason) from error


def _list(data: Any, place: str) -> list[Any]:
    if not isinstance(data, list):
        raise JournalValueError(place, f"got {type(data).__name__}; expected a list.")
    return [_decode(item, f"{place}[{i}]") for i, item in enumerate(data)]


def _fields(data: Any, place: str) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise JournalValueError(place, f"got {type(data).__name__}; expected fields.")
    return {key: _decode(value, f"{place}.{key}") for key, value in data.items()}


def _bytes(text: Any) -> bytes:
    return base64.b64decode(text, validate=True)


def _decode_datetime(data: dict[str, Any], place: str) -> datetime:
    value = datetime.fromisoformat(data["$datetime"]).replace(fold=data["fold"])
    if "zone" not in data:
        return value
    try:
        return value.replace(tzinfo=ZoneInfo(data["zone"]))
    except ZoneInfoNotFoundError as error:
        reason = f"got time zone {data['zone']!r}; expected one that this computer knows."
        raise JournalValueError(place, reason) from error


def _find(name: Any, place: str) -> RegisteredType:
    found = REGISTERED.get(name)
    if found is None:
        raise JournalValueError(
            place,
            f"got class {name!r}; expected one that is registered."
            f"{did_you_mean(str(name), REGISTERED)} Try smachpy.register_type before the run.",
        )
    return found


def _decode_fields(data: dict[str, Any], place: str) -> Any:
    kind = _find(data["$type"], place).kind
    values = _fields(data["fields"], place)
    if is_named_tuple(kind):
        return kind(**values)
    if not dataclasses.is_dataclass(kind):
        reason = f"got fields of {data['$type']}, which has none; expected a dataclass."
        raise JournalValueError(place, reason)
    known = {field.name: field.init for field in dataclasses.fields(kind)}
    unknown = sorted(values.keys() - known.keys())
    if unknown:
        reason = f"got fields {unknown} of {data['$type']}; expected {sorted(known)}."
        raise JournalValueError(place, reason)
    result = kind(**{name: value for name, value in values.items() if known[name]})
    for name, value in values.items():
        # `__post_init__` may have changed fields again; `object` also writes to frozen classes.
        object.__setattr__(result, name, value)
    return result


def _decode_enum(data: dict[str, Any], place: str) -> Any:
    kind: Any = _find(data["$enum"], place).kind
    return kind[data["name"]] if "name" in data else kind(_decode(data["value"], place))


def _decode_custom(data: dict[str, Any], place: str) -> Any:
    from_data = _find(data["$custom"], place).from_data
    if from_data is None:
        raise JournalValueError(place, f"got data of {data['$custom']}; expected its from_data.")
    value = _decode(data["data"], place)
    try:
        return from_data(value)
    except Exception as error:
        raise JournalValueError(
            place, f"from_data of {data['$custom']} raised {error!r}."
        ) from error


def _decode_message(data: dict[str, Any], place: str) -> Any:
    if "$msg" in data:
        from actionlib_core.interfaces import get_message

        kind: Any = get_message(data["$msg"])
        known = kind._md5sum
    else:
        from actionlib_core.interfaces.ros2 import get_message as get_ros2_message

        kind = get_ros2_message(data["$ros2"], data["distro"])
        known = kind._rihs01
    if data.get("sum", known) != known:  # journals of earlier versions have none
        reason = (
            f"got a {kind._type} of another definition, {data['sum']}; expected the present one, "
            f"{known}."
        )
        raise JournalValueError(place, reason)
    message = kind()
    values = _fields(data["fields"], place)
    if set(values) != set(kind.__slots__):
        reason = f"got fields {sorted(values)}; expected those of {kind._type}: {kind.__slots__}."
        raise JournalValueError(place, reason)
    for name, value in values.items():
        setattr(message, name, value)
    return message


def _decode_array(data: dict[str, Any], place: str) -> Any:
    import numpy as np

    dtype: Any = np.lib.format.descr_to_dtype(_decode(data["dtype"], place))
    if dtype.hasobject:
        raise JournalValueError(place, "got an array of Python objects; expected numbers.")
    is_scalar = "$scalar" in data
    shape = () if is_scalar else tuple(data["shape"])
    if dtype.itemsize == 0 or 0 in shape:  # `frombuffer` refuses items of size 0
        found = np.zeros(shape, dtype)
        return found[()] if is_scalar else found
    if is_scalar:
        return np.frombuffer(_bytes(data["$scalar"]), dtype)[0]
    # A copy, as an array over `bytes` cannot be written to.
    return np.frombuffer(_bytes(data["$array"]), dtype).reshape(shape).copy()


_DECODERS: Final[dict[str, Callable[[dict[str, Any], str], Any]]] = {
    "$tuple": lambda data, place: tuple(_list(data["$tuple"], place)),
    "$set": lambda data, place: set(_list(data["$set"], place)),
    "$frozenset": lambda data, place: frozenset(_list(data["$frozenset"], place)),
    "$items": lambda data, place: dict(_list(data["$items"], place)),
    "$bytes": lambda data, _: _bytes(data["$bytes"]),
    "$bytearray": lambda data, _: bytearray(_bytes(data["$bytearray"])),
    "$int": lambda data, _: int(data["$int"], 16),
    "$float": lambda data, _: float(data["$float"]),
    "$time": lambda data, _: Time(*data["$time"]),
    "$duration": lambda data, _: Duration(*data["$duration"]),
    "$datetime": _decode_datetime,
    "$date": lambda data, _: date.fromisoformat(data["$date"]),
    "$clock": lambda data, _: time.fromisoformat(data["$clock"]).replace(fold=data["fold"]),
    "$timedelta": lambda data, _: timedelta(*data["$timedelta"]),
    "$path": lambda data, _: Path(data["$path"]),
    "$purepath": lambda data, _: PurePosixPath(data["$purepath"]),
    "$msg": _decode_message,
    "$ros2": _decode_message,
    "$array": _decode_array,
    "$scalar": _decode_array,
    "$type": _decode_fields,
    "$enum": _decode_enum,
    "$custom": _decode_custom,
}
