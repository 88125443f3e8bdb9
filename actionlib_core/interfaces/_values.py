"""Values of fields: defaults, and recursive checks and conversions that name every bad field."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, TypeVar

from actionlib_core.exceptions import FieldError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._definition import (
    FLOATS,
    INTEGERS,
    OCTETS,
    Field,
    FieldType,
)
from actionlib_core.time import Duration, Time, TimeValue

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from actionlib_core.interfaces._message import Message

    AnyMessage = TypeVar("AnyMessage", bound=Message)
    AnyTime = TypeVar("AnyTime", bound=TimeValue)

TEXT_CODEC = ("utf-8", "surrogateescape")  # as in `_codegen.TEXT`
ROS2_TIMES: dict[str, type[Time | Duration]] = {
    "builtin_interfaces/msg/Time": Time,
    "builtin_interfaces/msg/Duration": Duration,
}
"""ROS 2's messages that accept the same values as our `Time` and `Duration` fields."""
HEADERS = ("std_msgs/Header", "std_msgs/msg/Header")
_MAX_SHOWN_ITEMS = 8  # array elements in a repr
_LARGEST_FLOAT32 = 3.4028235677973366e38  # rounds to infinity from here on
_DEFAULTS = {
    **dict.fromkeys(INTEGERS, "0"),
    **dict.fromkeys(FLOATS, "0.0"),
    "bool": "False",
    "string": '""',
    "time": "_Time()",
    "duration": "_Duration()",
}


def default_source(
    field: Field, resolve: Callable[[str], type[Message]], scope: dict[str, Any]
) -> str:
    """Return a Python expression of a field's default value; add its names to `scope`."""
    if isinstance(field.default, tuple):
        return f"[{', '.join(map(_literal, field.default))}]"
    if field.default is not None:
        return _literal(field.default)
    return _type_default(field.type, resolve, scope)


def _literal(value: Any) -> str:
    # inf and nan have no literal
    return f"float({str(value)!r})" if isinstance(value, float) else repr(value)


def _type_default(
    kind: FieldType, resolve: Callable[[str], type[Message]], scope: dict[str, Any]
) -> str:
    if kind.is_array and kind.length is None:
        return 'b""' if kind.base in OCTETS else "[]"
    if kind.is_array:
        if kind.base in OCTETS:
            return f"bytes({kind.length})"
        element = _type_default(kind.element, resolve, scope)
        if kind.is_builtin and kind.base not in {"time", "duration"}:
            return f"[{element}] * {kind.length}"
        return f"[{element} for _ in range({kind.length})]"
    if kind.is_builtin:
        return _DEFAULTS[kind.base]
    name = "_M_" + kind.base.replace("/", "_")
    scope[name] = resolve(kind.base)
    return f"{name}()"


def to_time(cls: type[AnyTime], value: Any) -> AnyTime:
    """Convert a value of a time field: seconds, or an object with `secs` and `nsecs`.

    Raises:
        TypeError: Another type, or out of range.
    """
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return cls.from_sec(value)
    if hasattr(value, "secs") and hasattr(value, "nsecs"):
        if isinstance(value, TimeValue) and not isinstance(value, cls):
            raise TypeError(f"expected {cls.__name__.lower()}, got {value!r}")
        return cls(value.secs, value.nsecs)
    raise TypeError(f"expected {cls.__name__.lower()} (float seconds will do), got {_kind(value)}")


def to_ros2_time(cls: type[AnyMessage], value: Any) -> AnyMessage:
    """Convert a value to a `builtin_interfaces` Time or Duration; as `to_time`."""
    plain_class = ROS2_TIMES[cls._type]
    taken = to_time(plain_class, value)
    return cls(sec=taken.secs, nanosec=taken.nsecs)  # type: ignore[call-arg] # its two fields


# --- deep check --------------------------------------------------------------------------------


def coerced(message: AnyMessage) -> AnyMessage:
    """Return a copy whose values have exactly their fields' types; `message` is unchanged.

    Raises:
        FieldError: Values that cannot be converted; the error lists all of them with their paths.
    """
    check = _Check(message._type, from_plain=False)
    # Not `type(message)`: a read-only view of a message in userdata has a type of its own.
    result = check.message(message.__class__, message, "$")
    check.finish()
    return result  # type: ignore[return-value] # of the class asked for


def filled(cls: type[AnyMessage], values: Mapping[str, Any]) -> AnyMessage:
    """Make a message from plain values, with defaults for missing fields.

    Raises:
        FieldError: Unknown fields or values that do not fit; the error lists all with their paths.
    """
    check = _Check(cls._type, from_plain=True)
    result = check.message(cls, values, "$")
    check.finish()
    return result  # type: ignore[return-value] # of the class asked for


class _Check:
    """Walks values against field types, converts them and collects problems."""

    def __init__(self, where: str, *, from_plain: bool) -> None:
        self._where = where
        self._from_plain = from_plain
        self._problems: list[str] = []

    def finish(self) -> None:
        if self._problems:
            raise FieldError(*self._problems)

    def _problem(self, path: str, what: str) -> None:
        self._problems.append(f"{self._where}: {path}: {what}")

    def message(self, cls: type[Message], value: Any, path: str) -> Message | None:
        if isinstance(value, cls):
            return self._from_message(cls, value, path)
        # Other forms only in plain data: a dict in the field of a message is a mistake.
        if self._from_plain and cls._type in HEADERS and value == "auto":
            return cls(stamp=Time.now())  # type: ignore[call-arg] # Header has a stamp
        if self._from_plain and hasattr(value, "keys"):
            return self._from_mapping(cls, value, path)
        if self._from_plain and value is None and not cls._definition.fields:
            return cls()
        self._problem(path, f"expected {cls._type}, got {_kind(value)}")
        return None

    def _from_message(self, cls: type[Message], value: Message, path: str) -> Message:
        result = cls.__new__(cls)
        for field in cls._definition.fields:
            inner = f"{path}.{field.attribute}"
            if not hasattr(value, field.attribute):
                self._problem(inner, f"expected {field.type}, got nothing (deleted)")
                continue
            given = getattr(value, field.attribute)
            setattr(result, field.attribute, self._field(cls, field.type, given, inner))
        return result

    def _from_mapping(self, cls: type[Message], values: Mapping[str, Any], path: str) -> Message:
        result = cls()
        known = {field.name: field for field in cls._definition.fields}
        known |= {field.attribute: field for field in cls._definition.fields}
        for name in values:
            field = known.get(name)
            if field is None:
                expected = ", ".join(f.name for f in cls._definition.fields) or "no fields"
                what = f"no such field in {cls._type}; expected {expected}."
                self._problem(f"{path}.{name}", what + did_you_mean(str(name), list(known)))
                continue
            converted = self._field(cls, field.type, values[name], f"{path}.{name}")
            setattr(result, field.attribute, converted)
        return result

    def _field(self, cls: type[Message], kind: FieldType, value: Any, path: str) -> Any:
        if kind.is_array:
            return self._array(cls, kind, value, path)
        return self._one(cls, kind, value, path)

    def _array(self, cls: type[Message], kind: FieldType, value: Any, path: str) -> Any:
        # Texts and dicts have a length too, but are not arrays.
        if isinstance(value, (str, dict)) or not hasattr(value, "__len__"):
            self._problem(path, f"expected {kind}, got {_kind(value)}")
            return None
        if getattr(value, "ndim", 1) != 1:
            self._problem(path, f"expected {kind}, got {value.ndim} dimensions")
            return None
        if kind.length is not None and len(value) != kind.length:
            self._problem(path, f"expected {kind}, got {len(value)} elements")
            return None
        if kind.most is not None and len(value) > kind.most:
            self._problem(path, f"expected {kind}, got {len(value)} elements")
            return None
        items: Iterable[Any] = value.tolist() if hasattr(value, "tolist") else value
        before = len(self._problems)
        result = [self._one(cls, kind.element, x, f"{path}[{i}]") for i, x in enumerate(items)]
        if kind.base in OCTETS and len(self._problems) == before:
            return bytes(result)
        return result

    def _one(self, cls: type[Message], kind: FieldType, value: Any, path: str) -> Any:
        base = kind.base
        try:
            if base in ROS2_TIMES and not isinstance(value, cls._nested[base]):
                return self._ros2_time(cls._nested[base], value, path)
            if base not in _CONVERTERS:
                return self.message(cls._nested[base], value, path)
            if self._from_plain and base in {"time", "duration"}:
                value = _plain_time(value)
            result = _CONVERTERS[base](value)
        except (TypeError, ValueError, OverflowError) as error:
            self._problem(path, str(error))
            return None
        if kind.most_text is not None:
            size = len(result.encode(*TEXT_CODEC))
            if size > kind.most_text:
                self._problem(path, f"expected {kind}, got {size} bytes")
                return None
        return result

    def _ros2_time(self, cls: type[AnyMessage], value: Any, path: str) -> Message | None:
        if self._from_plain and hasattr(value, "keys") and set(value) <= set(cls.__slots__):
            return self.message(cls, value, path)  # may be before 1970, which our `Time` is not
        if self._from_plain:
            value = _plain_time(value)
        # Checked as any message: our `Time` holds seconds that ROS 2's cannot.
        return self.message(cls, to_ros2_time(cls, value), path)


def _kind(value: object) -> str:
    """Return the name of a value's type; for a message, its ROS name."""
    name = getattr(value, "_type", None)
    return name if isinstance(name, str) else type(value).__name__


def _plain_time(value: Any) -> Any:
    """Convert the plain forms of a time, a dict or "now", for `to_time`."""
    if value == "now":
        return Time.now()
    if hasattr(value, "keys"):
        aliases = {"secs": "secs", "sec": "secs", "nsecs": "nsecs", "nanosec": "nsecs"}
        if unknown := [key for key in value if key not in aliases]:
            hint = did_you_mean(str(unknown[0]), list(aliases))
            raise TypeError(f"expected secs and nsecs, got {unknown[0]!r}.{hint}")
        parts = {aliases[key]: operator.index(part) for key, part in value.items()}
        return _Parts(parts.get("secs", 0), parts.get("nsecs", 0))
    return value


class _Parts:
    """Seconds and nanoseconds read from a dict."""

    def __init__(self, secs: int, nsecs: int) -> None:
        self.secs = secs
        self.nsecs = nsecs


def _integer(base: str) -> Callable[[Any], int]:
    lowest, highest = INTEGERS[base]

    def convert(value: Any) -> int:
        try:
            number = operator.index(value)
        except TypeError:
            raise TypeError(f"expected {base}, got {_kind(value)}") from None
        if not lowest <= number <= highest:
            raise ValueError(f"expected {base} ({lowest} to {highest}), got {number}")
        return number

    return convert


def _float(base: str) -> Callable[[Any], float]:
    def convert(value: Any) -> float:
        if isinstance(value, str) or not hasattr(value, "__float__"):
            raise TypeError(f"expected {base}, got {_kind(value)}")
        number = float(value)
        if base == "float32" and _LARGEST_FLOAT32 <= abs(number) < float("inf"):
            raise ValueError(f"expected float32 (up to 3.4e38), got {number}")
        return number

    return convert


def _bool(value: Any) -> bool:
    if isinstance(value, (str, bytes)) or value not in (True, False):
        raise TypeError(f"expected bool, got {value!r}")
    return bool(value)


def _string(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected string, got {_kind(value)}")
    try:
        value.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError as error:
        raise ValueError(f"expected text that UTF-8 can hold, got {value!r}") from error
    return str(value)


_CONVERTERS: dict[str, Callable[[Any], Any]] = {
    **{base: _integer(base) for base in INTEGERS},
    **{base: _float(base) for base in FLOATS},
    "bool": _bool,
    "string": _string,
    "time": lambda value: to_time(Time, value),
    "duration": lambda value: to_time(Duration, value),
}


# --- showing -----------------------------------------------------------------------------------


def plain(value: Any) -> Any:
    """Return dicts, lists, numbers and strings for a checked field value."""
    if hasattr(value, "_definition"):
        fields = value._definition.fields
        return {field.name: plain(getattr(value, field.attribute)) for field in fields}
    if isinstance(value, TimeValue):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, (list, bytes)):
        return [plain(item) for item in value]
    return value


def short(message: Message) -> str:
    """Return the `repr` of a message: constructor form, long arrays cut."""
    parts = [f"{name}={_short_value(getattr(message, name, ...))}" for name in message.__slots__]
    return f"{type(message).__name__}({', '.join(parts)})"


def _short_value(value: Any) -> str:
    if isinstance(value, bytes):
        if len(value) <= _MAX_SHOWN_ITEMS:
            return repr(value)
        return f"<{len(value)} bytes {value[:_MAX_SHOWN_ITEMS].hex(' ')} ...>"
    if isinstance(value, (list, tuple)) and len(value) > _MAX_SHOWN_ITEMS:
        head = ", ".join(repr(item) for item in value[:3])
        return f"[{head}, ... {len(value)} elements]"
    return repr(value)
