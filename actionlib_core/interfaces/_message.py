"""The base class of all messages, and the function that makes a message class."""

from __future__ import annotations

from collections import Counter
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, cast

from actionlib_core.exceptions import FieldError, InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces import _arrays
from actionlib_core.interfaces._codegen import make_codecs
from actionlib_core.interfaces._definition import attribute_of
from actionlib_core.interfaces._values import (
    ROS2_TIMES,
    coerced,
    default_source,
    filled,
    plain,
    short,
    to_ros2_time,
    to_time,
)
from actionlib_core.interfaces._yaml import dump, load
from actionlib_core.time import Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from actionlib_core.interfaces._definition import Definition

    Codecs = tuple[Callable[[Any], bytes], Callable[[bytes], Any]]


class Buffer(Protocol):
    """The target of `Message.serialize`, for example an `io.BytesIO`."""

    def write(self, data: bytes, /) -> object:
        """Write the bytes."""
        ...


class Message:
    """Base of all message classes, with the interface of ROS 1's generated classes, and more.

    The constructor accepts fields by position or keyword; the others have ROS's default values (0,
    False, "", empty arrays, default messages). A field can be set to any value: types are checked
    when the message is written (`to_bytes`, `serialize`, `to_yaml`), and the error lists every bad
    field with its path. `time` and `duration` fields accept float seconds: the constructor converts
    them at once; a value that is assigned later is converted only in the bytes.

    `uint8[]` and `char[]` are `bytes`; other arrays are lists. Lists, tuples, bytearrays and 1-D
    numpy arrays are accepted for every array.
    """

    __slots__: ClassVar[Any] = ()
    __hash__ = None  # type: ignore[assignment] # mutable
    __test__: ClassVar[bool] = False
    """For pytest, which takes an imported class `TestGoal` for tests."""

    _wire: ClassVar[str] = "ros1"
    """The serialisation: "ros1", also used by smachpy's own wire, or "ros2"."""
    _type: ClassVar[str]
    """ROS name, "pkg/Name"; of ROS 2's classes "pkg/msg/Name" (or srv, action)."""
    _md5sum: ClassVar[str]
    """ROS 1 checksum of the definition, 32 hexadecimal digits."""
    _slot_types: ClassVar[list[str]]
    """ROS types in the order of `__slots__`."""
    _full_text: ClassVar[str]
    """The definition with all those it uses, as ROS 1 publishes it."""
    _has_header: ClassVar[bool]
    """Whether the first field is a `std_msgs/Header header`."""
    _definition: ClassVar[Definition]
    _nested: ClassVar[dict[str, type[Message]]]
    _write: ClassVar[Any]  # static functions, which a type checker takes for methods
    _read: ClassVar[Any]
    _codecs: ClassVar[Callable[[], Codecs]]

    def to_bytes(self) -> bytes:
        """Return the ROS 1 serialisation.

        Raises:
            FieldError: Values do not fit their fields; the error lists all of them.
        """
        data: bytes = self._write(self)
        return data

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Make a message from its ROS 1 serialisation.

        Raises:
            DeserializationError: The bytes are not a message of this type.
        """
        return cls._read(data)  # type: ignore[no-any-return] # generated code

    def serialize(self, buff: Buffer) -> None:
        """Write the ROS 1 serialisation to a file-like object; raises as `to_bytes`."""
        buff.write(Message.to_bytes(self))

    def deserialize(self, data: bytes) -> Self:
        """Fill this message from its ROS 1 serialisation and return it; raises as `from_bytes`."""
        other = self._read(data)
        for name in self.__slots__:
            setattr(self, name, getattr(other, name))
        return self

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: nested dicts, lists, numbers; times as {"secs", "nsecs"}.

        Raises:
            FieldError: As `to_bytes`.
        """
        return dict(plain(coerced(self)))

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Make a message from plain values; fields not given have their defaults.

        A time is a number of seconds, a dict {"secs", "nsecs"} or "now"; a `Header` may be "auto"
        (stamped now).

        Raises:
            FieldError: Unknown fields or values that do not fit; the error lists all of them.
        """
        return filled(cls, values)

    def to_yaml(self) -> str:
        """Return YAML as `rostopic echo` prints it, which `from_yaml` reads back.

        Raises:
            FieldError: As `to_bytes`.
        """
        return dump(coerced(self))

    @classmethod
    def from_yaml(cls, text: str) -> Self:
        """Make a message from YAML text, block or flow style; values as in `from_dict`.

        Raises:
            FieldError: The text is not a YAML mapping, or as `from_dict`.
        """
        return filled(cls, load(text, cls._type))

    def __repr__(self) -> str:
        return short(self)

    def __str__(self) -> str:
        return dump(self)

    def __eq__(self, other: object) -> bool:
        # `__class__`, as the read-only view of a message in userdata has a type of its own.
        if other.__class__ is not self.__class__:
            return NotImplemented
        for field in self._definition.fields:
            mine, theirs = getattr(self, field.attribute), getattr(other, field.attribute)
            if field.type.is_array:
                if not _arrays.same(mine, theirs):
                    return False
            elif mine != theirs:
                return False
        return True

    def __getstate__(self) -> list[Any]:
        return [getattr(self, name) for name in self.__slots__]

    def __setstate__(self, state: list[Any]) -> None:
        for name, value in zip(self.__slots__, state, strict=True):
            setattr(self, name, value)


class Ros2Message(Message):
    """Base of the message classes of ROS 2, with CDR as bytes and the type hash as checksum.

    The other differences from ROS 1's (`Message`): a stamp is a `builtin_interfaces` message with
    `sec` and `nanosec`, for which float seconds, `Time` and `Duration` are accepted too; fields may
    have default values in their definition; arrays and strings may have limits.
    """

    __slots__: ClassVar[Any] = ()
    _wire: ClassVar[str] = "ros2"
    _rihs01: ClassVar[str]
    """Type hash, "RIHS01_" and 64 hexadecimal digits; computed on first use.

    Source: ROS 2 REP 2016."""
    _distro: ClassVar[str]
    """The distribution whose definition this is, "jazzy" for example."""

    def to_cdr(self) -> bytes:
        """Return the CDR serialisation, little-endian, with its 4 bytes of encapsulation.

        Padding is zero.

        Raises:
            FieldError: Values do not fit their fields; the error lists all of them.
        """
        return Message.to_bytes(self)

    @classmethod
    def from_cdr(cls, data: bytes) -> Self:
        """Make a message from its CDR serialisation, of either byte order.

        Extra bytes at the end are ignored, as by ROS 2's nodes.

        Raises:
            DeserializationError: The bytes are not a message of this type. It is a ValueError.
        """
        return cls._read(data)  # type: ignore[no-any-return] # generated code


def make_class(
    definition: Definition,
    resolve: Callable[[str], type[Message]],
    *,
    module: str,
    base: type[Message] = Message,
    make: Callable[..., Codecs] = make_codecs,
    **attributes: Any,
) -> type[Message]:
    """Make the class of a message.

    Args:
        definition: Its definition.
        resolve: Returns the class of a nested type.
        module: Value of `__module__`, from which the class can be imported (pickle needs it).
        base: Its base class.
        make: Makes its serialiser and deserialiser, with the arguments of `make_codecs`.
        attributes: Further attributes of the class, such as its checksum.
    """
    slots = [field.attribute for field in definition.fields]
    names = [*slots, *(constant.attribute for constant in definition.constants)]
    if twice := [name for name, count in Counter(names).items() if count > 1]:
        raise InterfaceError(f"{definition.source}: Python names used twice: {sorted(twice)}")
    namespace: dict[str, Any] = {
        "__slots__": slots,
        "__module__": module,
        "__doc__": _documentation(definition),
        "_type": definition.name,
        "_slot_types": [str(field.type) for field in definition.fields],
        "_has_header": definition.has_header,
        "_definition": definition,
        "_nested": {
            f.type.base: resolve(f.type.base) for f in definition.fields if not f.type.is_builtin
        },
    }
    namespace |= attributes
    # Constants are class attributes, as in ROS 1.
    namespace |= {constant.attribute: constant.value for constant in definition.constants}
    namespace["__init__"] = _make_init(definition, resolve)
    cls: Any = type(definition.short_name, (base,), namespace)

    @cache
    def codecs() -> Codecs:
        # On first use: most classes are only parts of others, whose code contains their fields.
        # If two threads come here at once, the work is done twice, without other consequences.
        write, read = make(cls, definition, resolve)
        cls._write = staticmethod(write)
        cls._read = staticmethod(read)
        return write, read

    # These two replace themselves, on first use, by the compiled functions.
    def first_write(message: Any) -> bytes:
        return codecs()[0](message)

    def first_read(data: bytes) -> Any:
        return codecs()[1](data)

    cls._codecs = staticmethod(codecs)
    cls._write = staticmethod(first_write)
    cls._read = staticmethod(first_read)
    for field in definition.fields:
        if field.name != field.attribute and not hasattr(base, field.name):
            # Also under the ROS name: `getattr(message, "in")`.
            setattr(cls, field.name, cls.__dict__[field.attribute])
    return cast("type[Message]", cls)


def codecs_of(cls: type[Message]) -> Codecs:
    """Return the compiled `to_bytes` and `from_bytes` of a class, for frequent use."""
    return cls._codecs()


def _documentation(definition: Definition) -> str:
    lines = [definition.comment or f"The ROS message {definition.name}.", ""]
    lines += [f"{f.attribute} ({f.type}): {f.comment}".rstrip(": ") for f in definition.fields]
    return "\n".join(lines).strip()


def _make_init(definition: Definition, resolve: Callable[[str], type[Message]]) -> Any:
    """Make `__init__` with one argument per field; None or no argument: the default value."""
    # These names begin with an underscore, which no field name does.
    scope: dict[str, Any] = {
        "_new": object.__new__,
        "_Time": Time,
        "_Duration": Duration,
        "_to_time": to_time,
        "_to_ros2_time": to_ros2_time,
        "_take_extra": _take_extra,
    }
    names = [field.attribute for field in definition.fields]
    lines = [f"def __init__({', '.join(['self', *(f'{n}=None' for n in names), '**_extra'])}):"]
    for field in definition.fields:
        name = field.attribute
        default = default_source(field, resolve, scope)
        given = name
        if not field.type.is_array and field.type.base in {"time", "duration"}:
            cls = "_Time" if field.type.base == "time" else "_Duration"
            given = f"{name} if {name}.__class__ is {cls} else _to_time({cls}, {name})"
            given = f"({given})"
        elif not field.type.is_array and field.type.base in ROS2_TIMES:
            cls = "_M_" + field.type.base.replace("/", "_")
            given = f"({name} if {name}.__class__ is {cls} else _to_ros2_time({cls}, {name}))"
        if default in {"_Time()", "_Duration()"}:
            # Written out for speed, as most messages have a header with a stamp.
            lines += [
                f"    if {name} is None:",
                f"        self.{name} = _t = _new({default[:-2]})",
                "        _t.secs = _t.nsecs = 0",
                f"    else: self.{name} = {given}",
            ]
        else:
            lines.append(f"    self.{name} = {default} if {name} is None else {given}")
    lines.append("    if _extra: _take_extra(self, _extra)")
    # Safe, as the text contains only names that the parser has checked.
    exec(compile("\n".join(lines), f"<__init__ of {definition.name}>", "exec"), scope)  # noqa: S102
    made = scope["__init__"]
    made.__qualname__ = f"{definition.name.rpartition('/')[2]}.__init__"  # for Python's errors
    return made


def _take_extra(message: Message, extra: dict[str, Any]) -> None:
    """Set fields given by ROS names that differ from Python's (`in`); refuse unknown ones."""
    known = list(message.__slots__)
    ours = {field.name: field.attribute for field in message._definition.fields}
    problems = [
        f"{message._type}: got unknown field {name!r}; expected {', '.join(known) or 'none'}."
        + did_you_mean(name, known, most=3)
        for name in extra
        if name not in ours
    ]
    if problems:
        raise FieldError(*problems)
    for name, value in extra.items():
        setattr(message, ours[name], value)


__all__ = ["Buffer", "Message", "Ros2Message", "attribute_of", "codecs_of", "make_class"]
