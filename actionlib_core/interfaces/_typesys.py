"""ROS 1's messages as CDR, with their type hashes, through `rosbags` (extra `cdr`), only here.

Types that ROS 2 has itself (std_msgs, geometry_msgs, ...) are used as ROS 2 defines them, your own
types as they are defined here. One difference is bridged: the `seq` of a `std_msgs/Header`, which
ROS 2 does not have, is left out, and is 0 on the way back.
"""

from __future__ import annotations

import functools
import threading
from typing import TYPE_CHECKING, Any

from actionlib_core.exceptions import DeserializationError, InterfaceError
from actionlib_core.interfaces._registry import registry

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

    from actionlib_core.interfaces._definition import Definition, Field
    from actionlib_core.interfaces._message import Message

_lock = threading.Lock()


def rihs01(cls: type[Message]) -> str:
    """Return the ROS 2 type hash of a message class, "RIHS01_" and 64 hexadecimal digits.

    Source: ROS 2 REP 2016.
    """
    with _lock:
        store = _store()
        name = _added(store, cls)
        return store.hash_rihs01(name)


def to_cdr(message: Message) -> bytes:
    """Return the CDR serialisation (little-endian, with its 4-byte header) as ROS 2 has it.

    Raises:
        FieldError: As `Message.to_bytes`.
        InterfaceError: ROS 2 defines the type, or one it uses, with other fields.
    """
    with _lock:
        store = _store()
        name = _comparable(store, type(message))
    return bytes(store.ros1_to_cdr(message.to_bytes(), name))


def from_cdr(cls: type[Message], data: bytes) -> Message:
    """Make a message from its little-endian CDR serialisation.

    Raises:
        DeserializationError: The bytes are not a message of this type.
        InterfaceError: As `to_cdr`.
    """
    from rosbags.serde import SerdeError

    with _lock:
        store = _store()
        name = _comparable(store, cls)
    try:
        ros1 = store.cdr_to_ros1(data, name)
    except (SerdeError, AssertionError, IndexError, ValueError) as error:
        raise DeserializationError(cls._type, len(data), f"as CDR: {error}") from error
    return cls.from_bytes(bytes(ros1))


@functools.cache
def _store() -> Typestore:
    """Return the types of ROS 2 Jazzy, to which ours are added."""
    try:
        from rosbags.typesys import Stores, get_typestore
    except ModuleNotFoundError as error:
        raise InterfaceError(
            f"a message of ROS 1 as CDR: package {error.name!r} is missing. "
            "Try: pip install 'smachpy[cdr]'"
        ) from error

    return get_typestore(Stores.ROS2_JAZZY)


def _ros2_name(name: str) -> str:
    package, _, short = name.partition("/")
    return f"{package}/msg/{short}"


def _added(store: Typestore, cls: type[Message]) -> str:
    """Add a class's type and the types that it uses to the store; return the ROS 2 name."""
    from rosbags.typesys import TypesysError, get_types_from_msg

    name = _ros2_name(cls._type)
    if name not in store.fielddefs:
        for field in cls._definition.fields:
            if not field.type.is_builtin:
                _added(store, registry.message(field.type.base))
        text = "\n".join(f"{field.type} {field.name}" for field in cls._definition.fields)
        try:
            store.register(get_types_from_msg(text, name))
        except TypesysError as error:
            raise InterfaceError(f"{cls._type}: ROS 2 cannot have this type: {error}") from error
    return name


def _comparable(store: Typestore, cls: type[Message]) -> str:
    """Return the ROS 2 name of a class after comparing all its fields, also nested ones.

    Raises:
        InterfaceError: ROS 2 defines the type, or one that it uses, with other fields.
    """
    name = _added(store, cls)
    ours = [(field.name, _description(field)) for field in _wire_fields(cls._definition)]
    theirs = [
        (field, _plain(description))
        for field, description in store.fielddefs[name][1]
        if field != "structure_needs_at_least_one_member"
    ]
    if ours != theirs:
        raise InterfaceError(
            f"{cls._type}: ROS 2 defines it otherwise: got fields {[n for n, _ in ours]}; ROS 2 "
            f"expects {[n for n, _ in theirs]} with its own types. Try defining a type of your own"
        )
    for field in cls._definition.fields:
        if not field.type.is_builtin:
            _comparable(store, registry.message(field.type.base))
    return name


def _wire_fields(definition: Definition) -> list[Field]:
    is_header = definition.name == "std_msgs/Header"
    return [field for field in definition.fields if not (is_header and field.name == "seq")]


def _description(field: Field) -> Any:
    """Describe our field in the terms of `_plain`."""
    kind = field.type
    times = {"time": "builtin_interfaces/msg/Time", "duration": "builtin_interfaces/msg/Duration"}
    base = _SAME.get(kind.base, kind.base)
    if kind.base in times:
        base = times[kind.base]
    elif not kind.is_builtin:
        base = _ros2_name(kind.base)
    return base, kind.is_array, kind.length or 0


def _plain(description: Any) -> Any:
    """Describe a field of rosbags: base type, whether it is an array, its fixed length."""
    from rosbags.interfaces import Nodetype

    node, content = description
    if node in {Nodetype.ARRAY, Nodetype.SEQUENCE}:
        (inner, base), length = content
        name = base[0] if inner == Nodetype.BASE else base
        return _SAME.get(name, name), True, length
    name = content[0] if node == Nodetype.BASE else content
    return _SAME.get(name, name), False, 0


_SAME = {"byte": "uint8", "char": "uint8", "int8": "uint8", "octet": "uint8"}
"""One-byte types have the same bytes; ROS 1 and ROS 2 disagree about which ones are signed."""
