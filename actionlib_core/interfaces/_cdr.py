"""Generator of a class's CDR serialiser and deserialisers: ROS 2's bytes.

Source: OMG CDR version 1 as ROS 2's middlewares write it: 4 bytes of encapsulation, then the
fields, each aligned to its size, counted from the first byte after those 4; a string after its
length as uint32, which includes the final NUL; an empty array is not aligned; a message without
fields has one byte.

Bytes are read as ROS 2's nodes read them: both byte orders are accepted, and so are strings without
NUL and any values in the padding, after the end, and in the last two bytes of the encapsulation.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from actionlib_core.interfaces import _arrays
from actionlib_core.interfaces._codegen import (
    TEXT,
    Cursor,
    FunctionSource,
    checked,
    new_scope,
    read_message,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from actionlib_core.interfaces._codegen import Resolve
    from actionlib_core.interfaces._definition import Definition, Field, FieldType
    from actionlib_core.interfaces._message import Message

_HEADER = b"\x00\x01\x00\x00"  # encapsulation of little-endian CDR
_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
_WIDEST = 8  # largest alignment [bytes]


def make_cdr_codecs(
    cls: type[Message], definition: Definition, resolve: Resolve
) -> tuple[Callable[[Any], bytes], Callable[[bytes], Any]]:
    """Return the functions `write(message) -> bytes` and `read(bytes) -> message` of a class.

    They raise as those of `make_codecs`.
    """
    scope = new_scope() | {"PAD": [bytes(size) for size in range(_WIDEST)], "HEADER": _HEADER}
    text = _write_source(definition, resolve, scope)
    readers: dict[str, Callable[[bytes], Any]] = {"<": _make_reader(cls, definition, resolve, "<")}
    _execute(text, definition, scope)

    def read(data: bytes) -> Any:
        order = _ORDERS.get(bytes(data[:2]))
        if order is None or len(data) < len(_HEADER):
            reason = f"it begins with {bytes(data[:4]).hex(' ') or 'nothing'}; expected 00 01 00 00"
            raise scope["Bad"](definition.name, len(data), reason)
        if order not in readers:
            readers[order] = _make_reader(cls, definition, resolve, order)
        return readers[order](data)

    return scope["write"], read


def _execute(text: str, definition: Definition, scope: dict[str, Any]) -> None:
    # Safe, as the text contains only names that the parser has checked and our own numbers.
    exec(compile(text, f"<CDR of {definition.name}>", "exec"), scope)  # noqa: S102


class _Output:
    """Emits writes to the bytearray `b`; consecutive scalars become one `pack` with padding.

    The length of `b` is known to be `_at` modulo `_modulus`. Where an alignment is wider than
    `_modulus`, the padding is computed at run time.
    """

    def __init__(self, source: FunctionSource, modulus: int = 1) -> None:
        self.source = source
        self._at = 0
        self._modulus = modulus
        self._codes = ""
        self._values: list[str] = []

    def scalar(self, code: str, value: str) -> None:
        self.align(struct.calcsize(code))
        self._codes += code
        self._values.append(value)

    def align(self, size: int) -> None:
        if self._modulus % size:
            self.flush()
            self.source.add(f"b += PAD[-len(b) % {size}]")
            self._at, self._modulus = 0, size
        else:
            self._codes += "x" * (-(self._at + struct.calcsize(f"<{self._codes}")) % size)

    def flush(self) -> None:
        if self._codes:
            pack = self.source.codec("pack", self._codes)
            self.source.add(f"b += {pack}({', '.join(self._values)})")
            self._at += struct.calcsize(f"<{self._codes}")
        self._codes, self._values = "", []

    def ready(self, expression: str, element_size: int = 1) -> None:
        """Write the bytes of any number of elements of a size."""
        self.flush()
        self.source.add(f"b += {expression}")
        self._at, self._modulus = 0, min(element_size, self._modulus)

    def moved(self) -> None:
        """Continue without any knowledge of the length."""
        self._at, self._modulus = 0, 1


def _write_source(definition: Definition, resolve: Resolve, scope: dict[str, Any]) -> str:
    source = FunctionSource(scope)
    source.add("b = bytearray()")
    output = _Output(source, modulus=_WIDEST)
    _write_fields(output, definition.fields, "m", resolve)
    output.flush()
    source.add("return HEADER + b")
    return source.writer()


def _write_fields(output: _Output, fields: tuple[Field, ...], owner: str, resolve: Resolve) -> None:
    if not fields:
        output.scalar("B", "0")
    for field in fields:
        value = f"{owner}.{field.attribute}"
        if field.type.is_array:
            _write_array(output, field.type, value, resolve)
        else:
            _write_one(output, field.type, value, resolve)


def _write_one(output: _Output, kind: FieldType, value: str, resolve: Resolve) -> None:
    source = output.source
    if kind.base == "bool":
        output.scalar("B", f"BOOLS[{value}]")
    elif kind.base in _arrays.STRUCT_CODES:
        output.scalar(_arrays.STRUCT_CODES[kind.base], value)
    elif kind.base == "string":
        name = source.local("s")
        source.add(f"{name} = {value}.encode({TEXT}) + b'\\0'")
        if kind.most_text is not None:
            source.add(f"if len({name}) > {kind.most_text + 1}: raise Mismatch")
        output.scalar("I", f"len({name})")
        output.ready(name)
    else:
        nested = resolve(kind.base)
        name = checked(source, value, nested)
        _write_fields(output, nested._definition.fields, name, resolve)


def _write_array(output: _Output, kind: FieldType, value: str, resolve: Resolve) -> None:
    source = output.source
    name = source.local("a")
    code = _arrays.STRUCT_CODES.get(kind.base)
    convert = {"?": f"bools({value})", "B": f"octets({value})", None: f"objects({value})"}
    source.add(f"{name} = {convert.get(code, value)}")
    if kind.length is not None:
        source.add(f"fixed({name}, {kind.length})")
    else:
        output.scalar("I", f"len({name})")
    if kind.most is not None:
        source.add(f"if len({name}) > {kind.most}: raise Mismatch")
    if code is None:
        _write_loop(output, kind, name, resolve)
        return
    size = struct.calcsize(code)
    # The length before a dynamic array has aligned it to 4 bytes. Wider elements need more, unless
    # there are none.
    if kind.length:
        output.align(size)
    elif size == _WIDEST:
        output.flush()
        source.add(f"if len({name}): b += PAD[-len(b) % {size}]")
    output.ready(name if code in {"B", "?"} else f"numbers({code!r}, {name})", min(size, 4))


def _write_loop(output: _Output, kind: FieldType, values: str, resolve: Resolve) -> None:
    source = output.source
    output.flush()
    element = source.local("x")
    source.add(f"for {element} in {values}:")
    source.indent += 1
    inner = _Output(source)
    _write_one(inner, kind.element, element, resolve)
    inner.flush()
    source.indent -= 1
    output.moved()


# --- reading -----------------------------------------------------------------------------------


class _AlignedCursor(Cursor):
    """Reads aligned values; the position is known to be `_at` modulo `_modulus`."""

    def __init__(self, source: FunctionSource, offset: str) -> None:
        super().__init__(source, offset)
        self._at = 0
        self._modulus = _WIDEST if offset == "0" else 1

    def scalar(self, code: str) -> str:
        self.align(struct.calcsize(code))
        return super().scalar(code)

    def align(self, size: int, *, unless_empty: str = "") -> None:
        if self._modulus % size:
            self.settle()
            condition = f"if {unless_empty}: " if unless_empty else ""
            self.source.add(f"{condition}p += -p % {size}")
            self._at, self._modulus = 0, 1 if unless_empty else size
        elif unless_empty:
            pad = -(self._at + struct.calcsize(f"<{self._codes}")) % size
            if pad:
                self.settle()
                self.source.add(f"if {unless_empty}: p += {pad}")
        else:
            self._codes += "x" * (-(self._at + struct.calcsize(f"<{self._codes}")) % size)

    def flush(self) -> None:
        if self._codes and not self._names:  # padding only
            size = len(self._codes)
            self.skip(size)
            self.minimum += size
            self._codes = ""
        super().flush()

    def skip(self, size: int) -> None:
        super().skip(size)
        self._at += size

    def moved(self) -> None:
        super().moved()
        self._at, self._modulus = 0, 1

    def text(self, length: str) -> str:
        return f"str({self.take(length)}.removesuffix(b'\\0'), {TEXT})"

    def empty(self) -> None:
        self.scalar("B")


def _make_reader(
    cls: type[Message], definition: Definition, resolve: Resolve, order: str
) -> Callable[[bytes], Any]:
    scope = new_scope()
    source = FunctionSource(scope, order)
    source.add(f"d = bytes(memoryview(d)[{len(_HEADER)}:])")
    source.add("try:")
    source.indent += 1
    cursor = _AlignedCursor(source, "0")
    result = read_message(cursor, cls, definition.fields, resolve)
    cursor.flush()
    end = cursor.position()
    source.add(f"if len(d) < {end}: raise Mismatch(f'expected {{{end} + {len(_HEADER)}}}')")
    for line in cursor.builds:
        source.add(line)
    source.add(f"return {result}")
    source.indent -= 1
    source.add("except READ_ERRORS as e:")
    source.add(f"    raise Bad({definition.name!r}, len(d) + {len(_HEADER)}, str(e)) from e")
    _execute(source.function("read(d)"), definition, scope)
    reader: Callable[[bytes], Any] = scope["read"]
    return reader
