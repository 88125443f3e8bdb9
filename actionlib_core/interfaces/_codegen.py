"""Generator of a class's serialiser and deserialiser, one flat function each.

All nested messages are unrolled: consecutive fields of fixed size become one `struct` call, and
nested objects are made without their `__init__`. This is three to ten times as fast as a call per
field or nested message, which matters because every goal and message passes through this code.

Source: the ROS 1 wire format, http://wiki.ros.org/ROS/Technical%20Overview: little-endian, without
padding, strings and dynamic arrays after their length as uint32.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final

from actionlib_core.exceptions import DeserializationError
from actionlib_core.interfaces import _arrays
from actionlib_core.interfaces._values import coerced
from actionlib_core.time import Duration, Time

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces._definition import Definition, Field, FieldType
    from actionlib_core.interfaces._message import Message

    Resolve = Callable[[str], type[Message]]

_TIMES: Final[dict[str, tuple[type[Time | Duration], str]]] = {
    "time": (Time, "II"),
    "duration": (Duration, "ii"),
}
TEXT = "'utf-8', 'surrogateescape'"  # bytes that are not UTF-8 are then preserved
_ZERO_SIZE_LIMIT = 1_000_000  # elements without content: the payload's size does not limit them

WRITE_ERRORS = (
    _arrays.MismatchError,
    struct.error,
    AttributeError,
    TypeError,
    ValueError,
    OverflowError,
    KeyError,
)
"""Exceptions of the fast path for values that it does not handle."""


class FunctionSource:
    """Source lines of a function; `scope` becomes the function's globals.

    Attributes:
        order: Byte order of numbers, as in `struct`.
    """

    def __init__(self, scope: dict[str, Any], order: str = "<") -> None:
        self.scope = scope
        self.order = order
        self.lines: list[str] = []
        self.indent = 1
        self._count = 0

    def add(self, line: str) -> None:
        self.lines.append("    " * self.indent + line)

    def local(self, prefix: str = "v") -> str:
        self._count += 1
        return f"{prefix}{self._count}"

    def bind(self, prefix: str, value: object) -> str:
        """Make `value` a global of the function and return its name."""
        for name, bound in self.scope.items():
            if bound is value and name.startswith(prefix):
                return name
        name = f"{prefix}{len(self.scope)}"
        self.scope[name] = value
        return name

    def codec(self, kind: str, codes: str) -> str:
        """Return the name of the `pack` or `unpack_from` of a struct."""
        name = f"{kind}_{codes.replace('?', 'o')}"
        # One `struct.Struct` per format and function, compiled when the function is made.
        if name not in self.scope:
            self.scope[name] = getattr(struct.Struct(f"{self.order}{codes}"), kind)
        return name

    def function(self, signature: str) -> str:
        return "\n".join([f"def {signature}:", *self.lines, ""])

    def writer(self) -> str:
        """Return the function `write` with the lines as its fast path.

        If a value does not have exactly the field's type, `coerced` makes a copy with converted
        values, or raises an error that lists all wrong ones; then the fast path runs once more.
        """
        body = ["    " + line for line in self.lines]
        return "\n".join(
            [
                "def write(m, again=True):",
                "    try:",
                *body,
                "    except WRITE_ERRORS:",
                "        if not again: raise",
                "        return write(coerced(m), False)",
                "",
            ]
        )


def make_codecs(
    cls: type[Message], definition: Definition, resolve: Resolve
) -> tuple[Callable[[Any], bytes], Callable[[bytes], Any]]:
    """Return the functions `write(message) -> bytes` and `read(bytes) -> message` of a class.

    `write` raises FieldError on values that do not fit; `read` raises DeserializationError.
    """
    scope = new_scope()
    text = _write_source(definition, resolve, scope) + _read_source(cls, definition, resolve, scope)
    # Safe, as the text contains only names that the parser has checked and our own numbers.
    exec(compile(text, f"<codecs of {definition.name}>", "exec"), scope)  # noqa: S102
    return scope["write"], scope["read"]


def new_scope() -> dict[str, Any]:
    """Return the names that generated functions use."""
    return {
        "Mismatch": _arrays.MismatchError,
        "WRITE_ERRORS": WRITE_ERRORS,
        "coerced": coerced,
        "Bad": DeserializationError,
        "READ_ERRORS": (struct.error, _arrays.MismatchError, OverflowError, TypeError),
        "new": object.__new__,
        "BOOLS": _arrays.BOOLS,
        "numbers": _arrays.numbers,
        "octets": _arrays.octets,
        "bools": _arrays.bools,
        "fixed": _arrays.fixed,
        "objects": _arrays.objects,
    }


# --- writing -----------------------------------------------------------------------------------


class _Items:
    """The parts of the payload in order: packed scalars, and expressions of bytes."""

    def __init__(self, source: FunctionSource) -> None:
        self._source = source
        self._parts: list[str] = []
        self._codes = ""
        self._values: list[str] = []

    def scalar(self, codes: str, *values: str) -> None:
        self._codes += codes
        self._values += values

    def ready(self, expression: str) -> None:
        self._flush()
        self._parts.append(expression)

    def _flush(self) -> None:
        if self._codes:
            pack = self._source.codec("pack", self._codes)
            self._parts.append(f"{pack}({', '.join(self._values)})")
        self._codes, self._values = "", []

    def parts(self) -> list[str]:
        self._flush()
        return self._parts


def _write_source(definition: Definition, resolve: Resolve, scope: dict[str, Any]) -> str:
    source = FunctionSource(scope)
    items = _Items(source)
    _write_fields(source, items, definition.fields, "m", resolve)
    parts = items.parts()
    if len(parts) <= 1:
        source.add(f"return {parts[0] if parts else repr(b'')}")
    else:
        source.add(f"return b''.join(({', '.join(parts)}))")
    return source.writer()


def _write_fields(
    source: FunctionSource, items: _Items, fields: tuple[Field, ...], owner: str, resolve: Resolve
) -> None:
    for field in fields:
        value = f"{owner}.{field.attribute}"
        if field.type.is_array:
            _write_array(source, items, field.type, value, resolve)
        else:
            _write_one(source, items, field.type, value, resolve)


def _write_one(
    source: FunctionSource, items: _Items, kind: FieldType, value: str, resolve: Resolve
) -> None:
    if kind.base == "bool":
        items.scalar("B", f"BOOLS[{value}]")
    elif kind.base in _arrays.STRUCT_CODES:
        items.scalar(_arrays.STRUCT_CODES[kind.base], value)
    elif kind.base == "string":
        name = source.local("s")
        source.add(f"{name} = {value}.encode({TEXT})")
        items.scalar("I", f"len({name})")
        items.ready(name)
    elif kind.base in _TIMES:
        time_class, codes = _TIMES[kind.base]
        name = checked(source, value, time_class)
        items.scalar(codes, f"{name}.secs", f"{name}.nsecs")
    else:
        nested = resolve(kind.base)
        name = checked(source, value, nested)
        _write_fields(source, items, nested._definition.fields, name, resolve)


def checked(source: FunctionSource, value: str, cls: type) -> str:
    """Assign `value` to a local, after a check that it is exactly of a class."""
    name = source.local()
    source.add(f"{name} = {value}")
    source.add(f"if {name}.__class__ is not {source.bind('C', cls)}: raise Mismatch")
    return name


def _write_array(
    source: FunctionSource, items: _Items, kind: FieldType, value: str, resolve: Resolve
) -> None:
    name = source.local("a")
    code = _arrays.STRUCT_CODES.get(kind.base)
    if kind.base == "bool":
        source.add(f"{name} = bools({value})")
    elif code == "B":
        source.add(f"{name} = octets({value})")
    elif code:
        source.add(f"{name} = {value}")
    else:
        source.add(f"{name} = objects({value})")
    if kind.length is None:
        items.scalar("I", f"len({name})")
    else:
        source.add(f"fixed({name}, {kind.length})")
    if code in {"B", "?"}:
        items.ready(name)
    elif code:
        items.ready(f"numbers({code!r}, {name})")
    else:
        items.ready(_write_loop(source, kind, name, resolve))


def _write_loop(source: FunctionSource, kind: FieldType, values: str, resolve: Resolve) -> str:
    """Write the elements one by one; return the expression of their bytes."""
    element, parts = source.local("x"), source.local("p")
    source.add(f"{parts} = []")
    source.add(f"for {element} in {values}:")
    source.indent += 1
    items = _Items(source)
    if kind.is_builtin:
        _write_one(source, items, kind.element, element, resolve)
    else:
        nested = resolve(kind.base)
        source.add(f"if {element}.__class__ is not {source.bind('C', nested)}: raise Mismatch")
        _write_fields(source, items, nested._definition.fields, element, resolve)
    for part in items.parts():
        source.add(f"{parts}.append({part})")
    source.indent -= 1
    return f"b''.join({parts})"


# --- reading -----------------------------------------------------------------------------------


class Cursor:
    """Emits reads in wire order; consecutive scalars become one `unpack_from`.

    A subclass for another format defines the end of strings, the bytes of an empty message, and the
    alignment of values.
    """

    def __init__(self, source: FunctionSource, offset: str) -> None:
        self.source = source
        self._offset = offset  # "0" or a variable; then plus `_skip` bytes
        self._skip = 0
        self._codes = ""
        self._names: list[str] = []
        self.builds: list[str] = []
        self.minimum = 0

    def scalar(self, code: str) -> str:
        name = self.source.local("f")
        self._codes += code
        self._names.append(name)
        return name

    def flush(self) -> None:
        if self._codes:
            unpack = self.source.codec("unpack_from", self._codes)
            targets = ", ".join(self._names)
            self.source.add(f"{targets}, = {unpack}(d, {self.position()})")
            size = struct.calcsize(f"<{self._codes}")
            self.skip(size)
            self.minimum += size
        self._codes, self._names = "", []

    def skip(self, size: int) -> None:
        """Advance by `size` bytes."""
        self._skip += size

    def position(self) -> str:
        """Return the expression of the next byte's position; call `flush` before."""
        if self._offset == "0":
            return str(self._skip)
        return f"{self._offset} + {self._skip}" if self._skip else self._offset

    def settle(self) -> None:
        """Set the variable `p` to the position of the next byte."""
        self.flush()
        if self._offset != "p" or self._skip:
            self.source.add(f"p = {self.position()}")
        self.moved()

    def moved(self) -> None:
        """Continue at the variable `p`."""
        self._offset, self._skip = "p", 0

    def take(self, length: str) -> str:
        """Advance by `length` bytes; return the expression of their slice."""
        self.flush()
        start = self.position()
        name = start
        if not start.isidentifier() and not start.isdigit():
            name = self.source.local("q")
            self.source.add(f"{name} = {start}")
        elif start == "p":
            name = self.source.local("q")
            self.source.add(f"{name} = p")
        self.source.add(f"p = {name} + {length}")
        self.moved()
        return f"d[{name}:p]"

    def text(self, length: str) -> str:
        """Advance by a string of `length` bytes; return its expression."""
        return f"str({self.take(length)}, {TEXT})"

    def empty(self) -> None:
        """Advance by the bytes of a message without fields."""

    def align(self, size: int, *, unless_empty: str = "") -> None:
        """Advance to the next aligned position of a value of `size` bytes.

        Args:
            size: A power of two.
            unless_empty: The count of an array, which is not aligned when it is empty.
        """


def _read_source(
    cls: type[Message], definition: Definition, resolve: Resolve, scope: dict[str, Any]
) -> str:
    source = FunctionSource(scope)
    source.add("if d.__class__ is not bytes: d = bytes(memoryview(d))")
    source.add("try:")
    source.indent += 1
    cursor = Cursor(source, "0")
    result = read_message(cursor, cls, definition.fields, resolve)
    cursor.flush()
    end = cursor.position()
    source.add(f"if len(d) != {end}: raise Mismatch(f'it should end at byte {{{end}}}')")
    # The object is made only after all bytes were read and their number was checked.
    for line in cursor.builds:
        source.add(line)
    source.add(f"return {result}")
    source.indent -= 1
    source.add("except READ_ERRORS as e:")
    source.add(f"    raise Bad({definition.name!r}, len(d), str(e)) from e")
    return source.function("read(d)")


def read_message(
    cursor: Cursor, cls: type[Message], fields: tuple[Field, ...], resolve: Resolve
) -> str:
    """Read the fields. The lines in `cursor.builds` make the object, after everything is read."""
    name = cursor.source.local("o")
    cursor.builds.append(f"{name} = new({cursor.source.bind('C', cls)})")
    if not fields:
        cursor.empty()
    for field in fields:
        if field.type.is_array:
            value = _read_array(cursor, field.type, resolve)
        else:
            value = _read_one(cursor, field.type, resolve)
        cursor.builds.append(f"{name}.{field.attribute} = {value}")
    return name


def _read_one(cursor: Cursor, kind: FieldType, resolve: Resolve) -> str:
    if kind.base in _arrays.STRUCT_CODES:
        return cursor.scalar(_arrays.STRUCT_CODES[kind.base])
    if kind.base == "string":
        length = cursor.scalar("I")
        name = cursor.source.local("s")
        cursor.source.add(f"{name} = {cursor.text(length)}")
        return name
    if kind.base in _TIMES:
        time_class, codes = _TIMES[kind.base]
        secs, nsecs = cursor.scalar(codes[0]), cursor.scalar(codes[1])
        name = cursor.source.local("t")
        bound = cursor.source.bind("C", time_class)
        # The nsecs of a sender may be a second or more; `set` normalises them.
        cursor.builds += [
            f"{name} = new({bound}); {name}.secs = {secs}; {name}.nsecs = {nsecs}",
            f"if not 0 <= {nsecs} < 1000000000: {name}.set({secs}, {nsecs})",
        ]
        return name
    nested = resolve(kind.base)
    return read_message(cursor, nested, nested._definition.fields, resolve)


def _read_array(cursor: Cursor, kind: FieldType, resolve: Resolve) -> str:
    count = cursor.scalar("I") if kind.length is None else str(kind.length)
    name = cursor.source.local("a")
    code = _arrays.STRUCT_CODES.get(kind.base)
    if code == "B":
        cursor.source.add(f"{name} = {cursor.take(count)}")
    elif code and kind.length is not None:
        cursor.align(struct.calcsize(code))
        cursor.flush()
        unpack = cursor.source.codec("unpack_from", f"{kind.length}{code}")
        cursor.source.add(f"{name} = list({unpack}(d, {cursor.position()}))")
        cursor.skip(kind.length * struct.calcsize(code))
    elif code:
        size = struct.calcsize(f"<{code}")
        cursor.align(size, unless_empty=count)
        cursor.flush()
        start = cursor.position()
        unpack = cursor.source.bind("unpack_from", struct.unpack_from)
        cursor.source.add(
            f"{name} = list({unpack}(f'{cursor.source.order}{{{count}}}{code}', d, {start}))"
        )
        cursor.source.add(f"p = {start} + {count} * {size}")
        cursor.moved()
    else:
        _read_loop(cursor, kind, name, count, resolve)
    return name


def _read_loop(cursor: Cursor, kind: FieldType, name: str, count: str, resolve: Resolve) -> None:
    """Read the elements one by one into the list `name`."""
    source = cursor.source
    cursor.settle()
    source.add(f"{name} = []")
    guard = len(source.lines)
    source.add(f"for _ in range({count}):")
    source.indent += 1
    inner = type(cursor)(source, "p")
    element = _read_one(inner, kind.element, resolve)
    inner.settle()
    for line in inner.builds:
        source.add(line)
    source.add(f"{name}.append({element})")
    source.indent -= 1
    # A wrong count would otherwise fill the memory, or take long, before the bytes run out.
    bound = f"(len(d) - p) // {inner.minimum}" if inner.minimum else str(_ZERO_SIZE_LIMIT)
    text = f"if {count} > {bound}: raise Mismatch(f'an array says it has {{{count}}} elements')"
    source.lines.insert(guard, "    " * source.indent + text)
