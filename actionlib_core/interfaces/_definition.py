"""The parser of `.msg` text: fields, constants and comments, or errors with file, line and caret.

Source: the ROS 1 message description format, http://wiki.ros.org/msg. `rosbags` is not used here,
because it drops positions, comments and the spelling of constants (which the ROS 1 checksum
covers); the tests compare the results with those of `rosbags`.
"""

from __future__ import annotations

import keyword
import re
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from actionlib_core.exceptions import InterfaceError
from actionlib_core.inputs.suggest import did_you_mean
from actionlib_core.interfaces._arrays import STRUCT_CODES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

INTEGERS = {
    "int8": (-(2**7), 2**7 - 1),
    "uint8": (0, 2**8 - 1),
    "int16": (-(2**15), 2**15 - 1),
    "uint16": (0, 2**16 - 1),
    "int32": (-(2**31), 2**31 - 1),
    "uint32": (0, 2**32 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint64": (0, 2**64 - 1),
    # Old names. In ROS 1 a byte is signed and a char is unsigned.
    "byte": (-(2**7), 2**7 - 1),
    "char": (0, 2**8 - 1),
    # ROS 2's `byte`, which has a type hash of its own.
    "octet": (0, 2**8 - 1),
}
"""Lowest and highest value of each integer type."""

FLOATS = ("float32", "float64")
TIMES = ("time", "duration")
BUILTINS = tuple(n for n in (*INTEGERS, *FLOATS, "bool", "string", *TIMES) if n != "octet")
"""ROS 1's built-in types."""
OCTETS = ("uint8", "char", "octet")
"""Types whose arrays are `bytes`."""
AS_ROS2 = "Try importing it from `actionlib_core.interfaces.ros2`"
_ROS2_SPELT = {"char": "uint8", "byte": "octet"}
"""ROS 2's names of one byte: `char` is another name of `uint8`, `byte` is unsigned."""
_ROS2_BUILTINS = (*(name for name in BUILTINS if name not in {*TIMES, "char"}), "octet")

# Names of a message class's own; the attribute of such a field gets a trailing underscore.
RESERVED = frozenset(
    {
        *("serialize", "deserialize", "to_bytes", "from_bytes"),
        *("to_yaml", "from_yaml", "to_dict", "from_dict", "to_cdr", "from_cdr", "self"),
    }
)

_LENGTH_DIGITS = 18  # of an array's length; with more, any array is too large
_MAX_SHOWN_LENGTH = 40

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_TYPE = re.compile(r"([A-Za-z0-9_/]+?)(\[(\d*)\])?\Z")
_ROS2_NAME = re.compile(r"[a-z]\w*/(msg|srv|action)/\w+(\[\d*\])?\Z", re.ASCII)
_TYPE_PATH = re.compile(r"([a-zA-Z][A-Za-z0-9_]*/)?[A-Za-z][A-Za-z0-9_]*\Z")


@dataclass(frozen=True, slots=True)
class TextPosition:
    """A position in a definition, for error messages."""

    source: str
    line: int
    column: int
    text: str

    def problem(self, what: str) -> str:
        """Return `what` under its file and line, with a caret below the offending column."""
        shown = self.text.expandtabs(1).rstrip()
        return f"{self.source}:{self.line}: {what}\n    {shown}\n    {' ' * self.column}^"


@dataclass(frozen=True, slots=True)
class FieldType:
    """The type of a field.

    Attributes:
        base: A built-in such as "float64", or a message type "pkg/Name".
        is_array: Whether it is an array.
        length: The length of a fixed array, None for a dynamic one.
        most: Most elements of a dynamic array (ROS 2's `type[<=N]`); None: no limit.
        most_text: Most bytes of a string (ROS 2's `string<=N`); None: no limit.
    """

    base: str
    is_array: bool = False
    length: int | None = None
    most: int | None = None
    most_text: int | None = None

    @property
    def element(self) -> FieldType:
        """The type of an array's elements."""
        return FieldType(self.base, most_text=self.most_text)

    @property
    def is_builtin(self) -> bool:
        """Whether the base is a built-in type, not a message."""
        return self.base in BUILTINS or self.base == "octet"

    @property
    def suffix(self) -> str:
        """The array part of the ROS spelling: "", "[]", "[9]" or "[<=9]"."""
        if not self.is_array:
            return ""
        if self.most is not None:
            return f"[<={self.most}]"
        return f"[{'' if self.length is None else self.length}]"

    def __str__(self) -> str:
        base = "byte" if self.base == "octet" else self.base
        bound = "" if self.most_text is None else f"<={self.most_text}"
        return f"{base}{bound}{self.suffix}"


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message.

    Attributes:
        name: Its ROS name, from which `attribute` differs for Python's keywords.
        default: Its default value in ROS 2, a tuple or bytes for an array; None: that of the type.
    """

    name: str
    type: FieldType
    position: TextPosition = field(compare=False, repr=False)
    comment: str = ""
    default: Any = None

    @property
    def attribute(self) -> str:
        """The attribute of the message class."""
        return attribute_of(self.name)


@dataclass(frozen=True, slots=True)
class Constant:
    """One constant; `text` is its value as it is spelt, which the checksum covers."""

    name: str
    type: str
    value: bool | int | float | str
    text: str
    comment: str = ""

    @property
    def attribute(self) -> str:
        """The attribute of the message class."""
        return attribute_of(self.name)


@dataclass(frozen=True, slots=True)
class Definition:
    """A message type: name, fields, constants and their text.

    The name is "pkg/Name", for ROS 2 types "pkg/msg/Name" (or srv, action).
    """

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...]
    text: str
    source: str
    comment: str = ""

    @property
    def package(self) -> str:
        """The package part of the name."""
        return self.name.partition("/")[0]

    @property
    def has_header(self) -> bool:
        """Whether it begins with `Header header`; ROS 1's publishers number such messages."""
        first = self.fields[0] if self.fields else None
        return first is not None and (first.name, str(first.type)) == ("header", "std_msgs/Header")

    @property
    def short_name(self) -> str:
        """The name without its package."""
        return self.name.rpartition("/")[2]


def attribute_of(name: str) -> str:
    """Return the Python attribute of a field: keywords and `RESERVED` names get a "_"."""
    return f"{name}_" if keyword.iskeyword(name) or name in RESERVED else name


def parse(name: str, text: str, *, source: str = "", first_line: int = 1) -> Definition:
    """Read the text of one message.

    Args:
        name: Its type, "pkg/Name", or "pkg/msg/Name" for a text in ROS 2's dialect (bounded types,
            default values, quoted strings); bare types in the text belong to the same package.
        text: The definition, lines of `type name` and `type NAME=value`.
        source: File name for error messages; the name when "".
        first_line: Number of the text's first line in that file.

    Raises:
        InterfaceError: Malformed lines; the error lists all of them.
    """
    reader = _Ros2Reader if name.count("/") > 1 else _DefinitionParser
    return reader(name, source or name, first_line).read(text)


class _DefinitionParser:
    """Collects fields, constants and problems of one message text, line by line."""

    def __init__(self, name: str, source: str, first_line: int) -> None:
        self.name = name
        self.package = name.partition("/")[0]
        self.source = source
        self.first_line = first_line
        self.fields: list[Field] = []
        self.constants: list[Constant] = []
        self.problems: list[str] = []
        self.seen: dict[str, int] = {}

    def read(self, text: str) -> Definition:
        head: list[str] = []
        block: list[str] = []
        for number, line in enumerate(text.splitlines(), self.first_line):
            code, comment = self._split(line)
            if not code.strip():
                if "#" in line:
                    block.append(comment.strip())
                    continue
                # A block of comments before a blank line and any field describes the message.
                head = head or ([] if self.seen else block)
                block = []
                continue
            at = TextPosition(self.source, number, len(code) - len(code.lstrip()), line)
            self._line(at, code, " ".join(filter(None, [*block, comment.strip()])))
            block = []
        if self.problems:
            raise InterfaceError(*self.problems)
        if not self.seen:
            head = head or block
        fields, constants = tuple(self.fields), tuple(self.constants)
        return Definition(self.name, fields, constants, text, self.source, " ".join(head))

    def _split(self, line: str) -> tuple[str, str]:
        """Return the part of a line before its comment, and the comment."""
        code, _, comment = line.partition("#")
        return code, comment

    def _line(self, at: TextPosition, code: str, comment: str) -> None:
        words = code.split(None, 1)
        kind = self._type(at, words[0])
        if kind is None:
            return
        if len(words) == 1:
            self._problem(at, at.column + len(words[0]), "no field name; expected `type name`")
            return
        column = code.index(words[1], at.column + len(words[0]))
        # Only constants have "=": ROS 1 has no default values.
        if "=" in words[1]:
            self._constant(at, column, kind, words[1], comment)
        else:
            self._field(at, column, kind, words[1].strip(), comment)

    def _type(self, at: TextPosition, text: str) -> FieldType | None:
        match = _TYPE.match(text)
        if match is None or not _TYPE_PATH.match(match[1]):
            self._bad_type(at, text)
            return None
        base, is_array, length = match[1], match[2] is not None, (match[3] or "").lstrip("0")
        if len(length) > _LENGTH_DIGITS:
            shown = text if len(text) < _MAX_SHOWN_LENGTH else f"{text[:_MAX_SHOWN_LENGTH]}..."
            self._problem(at, at.column, f"{shown}: {too_large(f'10^{len(length) - 1} bytes')}")
            return None
        if base == "Header":
            base = "std_msgs/Header"
        elif base not in BUILTINS and "/" not in base:
            base = f"{self.package}/{base}"
        return FieldType(base, is_array, int(length or 0) if match[3] else None)

    def _bad_type(self, at: TextPosition, text: str) -> None:
        if "<=" in text:
            what = (
                f"bounded type {text!r} is ROS 2's; expected ROS 1's `string`, `type[]`, "
                f"`type[N]`. {AS_ROS2}"
            )
        elif _ROS2_NAME.match(text):
            what = f"type {text!r} is written as in ROS 2; expected `package/Name`. {AS_ROS2}"
        elif "[" in text or "]" in text:
            what = f"malformed array {text!r}; expected `type[]` or `type[N]`"
        else:
            hint = did_you_mean(text.strip("-:;,"), BUILTINS)
            what = f"malformed type {text!r}; expected a built-in type or `package/Name`.{hint}"
        self._problem(at, at.column, what)

    def _field(
        self, at: TextPosition, column: int, kind: FieldType, name: str, comment: str
    ) -> None:
        words = name.split()
        if len(words) > 1 and _NAME.match(words[0]):
            what = f"unexpected {words[1]!r} behind the field name; expected `type name`"
            hint = f". Default values are ROS 2's; a constant is `type NAME=value`. {AS_ROS2}"
            self._problem(at, column + name.index(words[1], len(words[0])), what + hint)
            return
        if self._check_name(at, column, name, "field"):
            where = TextPosition(at.source, at.line, at.column, at.text)
            self.fields.append(Field(name, kind, where, comment))

    def _constant(
        self, at: TextPosition, column: int, kind: FieldType, code: str, comment: str
    ) -> None:
        name = code.split("=", 1)[0].strip()
        if kind.is_array or not kind.is_builtin or kind.base in TIMES:
            what = f"a constant cannot be a {kind}; expected a number, bool or string type"
            self._problem(at, at.column, what)
            return
        if not self._check_name(at, column, name, "constant"):
            return
        # A string constant is the rest of the line, including any "#" (http://wiki.ros.org/msg).
        if kind.base == "string":
            raw, comment = at.text.split("=", 1)[1], ""
        else:
            raw = code.split("=", 1)[1]
        try:
            value = _constant_value(kind.base, raw.strip())
        except ValueError as error:
            self._problem(at, at.text.index("=") + 1, f"constant {name}: {error}")
            return
        self.constants.append(Constant(name, kind.base, value, raw.strip(), comment))

    def _check_name(self, at: TextPosition, column: int, name: str, what: str) -> bool:
        if not _NAME.match(name):
            rule = "a letter, then letters, digits and underscores"
            self._problem(at, column, f"invalid {what} name: got {name!r}; expected {rule}")
            return False
        if name in self.seen:
            first = self.seen[name]
            self._problem(at, column, f"duplicate name {name!r}; line {first} has it already")
            return False
        self.seen[name] = at.line
        return True

    def _problem(self, at: TextPosition, column: int, what: str) -> None:
        where = TextPosition(at.source, at.line, column, at.text)
        self.problems.append(where.problem(what))


_ROS2_TYPE = re.compile(
    r"(?:([a-z][a-z0-9_]*)/)?(?:(msg|srv|action)/)?([A-Za-z][A-Za-z0-9_]*)"
    r"(?:<=(\d+))?(\[(<=)?(\d*)\])?\Z"
)


class _Ros2Reader(_DefinitionParser):
    """The parser of ROS 2's dialect.

    Source: https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html
    """

    def _split(self, line: str) -> tuple[str, str]:
        line = line.expandtabs(1)  # as ROS 2 does: a tab separates words as a space does
        quote = ""  # within quotes, "#" does not begin a comment
        for index, character in enumerate(line):
            before = line[index - 1 : index]
            if quote:
                quote = "" if character == quote and before != "\\" else quote
            elif character == "#":
                return line[:index], line[index + 1 :]
            # Elsewhere it is an apostrophe, as in `string TEXT=don't # a comment`.
            elif character in {'"', "'"} and before in {" ", "=", "[", ","}:
                quote = character
        return line, ""

    def _type(self, at: TextPosition, text: str) -> FieldType | None:
        match = _ROS2_TYPE.match(text)
        if (
            match is None
            or (match[4] and match[3] not in {"string", "wstring"})
            or match[5] == "[<=]"
        ):
            self._problem(at, at.column, self._malformed(text))
            return None
        if max(len(match[4] or ""), len(match[7] or "")) > _LENGTH_DIGITS:
            self._problem(at, at.column, too_large("10^18 bytes"))
            return None
        package, kind, short = match[1], match[2], match[3]
        count = int(match[7]) if match[7] else None
        base = _ROS2_SPELT.get(short, short)
        if package or base not in _ROS2_BUILTINS:
            if short in {"time", "duration", "wstring"} and not package:
                self._problem(at, at.column, self._unsupported(short))
                return None
            base = f"{package or self.package}/{kind or 'msg'}/{short}"
        return FieldType(
            base,
            is_array=match[5] is not None,
            length=None if match[6] else count,
            most=count if match[6] else None,
            most_text=int(match[4]) if match[4] else None,
        )

    @staticmethod
    def _malformed(text: str) -> str:
        hint = did_you_mean(text.strip("-:;,"), _ROS2_BUILTINS)
        return (
            f"malformed type {text!r}; expected a built-in type, `package/Name`, `string<=N`, or "
            f"one of these with `[]`, `[N]` or `[<=N]` behind it.{hint}"
        )

    @staticmethod
    def _unsupported(short: str) -> str:
        if short == "wstring":
            return "got type 'wstring', which cannot be used here; expected `string`"
        return (
            f"got ROS 1's type {short!r}; expected `builtin_interfaces/{short.title()}`, as ROS 2 "
            "has it"
        )

    def _field(
        self, at: TextPosition, column: int, kind: FieldType, name: str, comment: str
    ) -> None:
        name, _, value = name.partition(" ")
        if not self._check_name(at, column, name, "field"):
            return
        default = None
        if value.strip():
            try:
                default = _ros2_value(kind, value.strip())
            except ValueError as error:
                where = at.text.expandtabs(1).index(value.strip(), column)
                self._problem(at, where, f"default value of {name}: {error}")
                return
        self.fields.append(Field(name, kind, at, comment, default))

    def _constant(
        self, at: TextPosition, column: int, kind: FieldType, code: str, comment: str
    ) -> None:
        name, _, raw = (part.strip() for part in code.partition("="))
        if kind.is_array or not kind.is_builtin:
            what = f"a constant cannot be a {kind}; expected a number, bool or string type"
            self._problem(at, at.column, what)
            return
        if not self._check_name(at, column, name, "constant"):
            return
        try:
            value = _ros2_value(kind, raw)
        except ValueError as error:
            self._problem(at, at.text.index("=") + 1, f"constant {name}: {error}")
            return
        self.constants.append(Constant(name, kind.base, value, raw, comment))


# Commas within quotes are not separators.
_ARRAY_VALUE = re.compile(r"""\s*("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|[^,]+)""")


def _ros2_value(kind: FieldType, text: str) -> Any:
    """Convert the text of a default value or constant; raises ValueError for a wrong one."""
    if kind.is_array:
        if not (kind.is_builtin and text.startswith("[") and text.endswith("]")):
            raise ValueError(f"got {text!r}; expected `[value, ...]` for an array of built-in type")
        parts = _ARRAY_VALUE.findall(text[1:-1])
        values = [_ros2_value(kind.element, part.strip()) for part in parts if part.strip()]
        if kind.length not in {None, len(values)} or len(values) > (kind.most or len(values)):
            raise ValueError(f"got {len(values)} values; expected {kind}")
        return bytes(values) if kind.base in OCTETS else tuple(values)
    if not kind.is_builtin:
        raise ValueError(f"got {text!r}; expected none, the type is a message")
    if kind.base == "string" and len(text) > 1 and text[0] == text[-1] and text[0] in "\"'":
        text = text[1:-1].replace(f"\\{text[0]}", text[0])
    if kind.most_text is not None and len(text.encode()) > kind.most_text:
        raise ValueError(f"got {len(text.encode())} bytes; expected {kind}")
    return _constant_value(kind.base, text)


def _constant_value(kind: str, text: str) -> bool | int | float | str:
    """Convert the text of a constant; raises ValueError for a wrong one."""
    if kind == "string":
        return text
    if kind == "bool":
        values = {"true": True, "1": True, "false": False, "0": False}
        if text.lower() not in values:
            raise ValueError(f"got {text!r}; expected True or False")
        return values[text.lower()]
    if kind in FLOATS:
        try:
            return float(text)
        except ValueError:
            raise ValueError(f"got {text!r}; expected a number") from None
    lowest, highest = INTEGERS[kind]
    try:
        # Base 0 reads 0x10 but refuses 010, which ROS reads as ten.
        number = int(text, 10 if text.lstrip("+-").isdigit() else 0)
    except ValueError:
        raise ValueError(f"got {text!r}; expected a whole number") from None
    if not lowest <= number <= highest:
        raise ValueError(f"got {number}; expected {lowest} to {highest} ({kind})")
    return number


# --- size and depth: types that no computer could handle are refused at their definition --------

LARGEST = 100_000_000  # size of a message with its default values [bytes]
MAX_FIELDS = 10_000  # the generated code has a line for each field; those of ROS have some hundreds
MAX_TYPE_NESTING = 50  # nested types: checking and printing values is recursive
NESTED = "types in one another"
MAX_ARRAY_NESTING = (
    19  # nested arrays: CPython allows 20 nested blocks, and the code's `try` is one
)

_SIZES = {base: struct.calcsize(f"<{code}") for base, code in STRUCT_CODES.items()}
_SIZES |= {"string": 4, "time": 8, "duration": 8}
_LENGTH_SIZE = 4  # of a dynamic array


class Extent(NamedTuple):
    """The size of a type or field.

    Attributes:
        size: Size of the default value [bytes].
        fields: Number of fields; those of nested types count wherever the type is used.
        depth: Depth of nested types; 0 for a built-in one.
        loops: Depth of nested arrays.
    """

    size: int
    fields: int
    depth: int
    loops: int


def field_extent(kind: FieldType, extent_of: Callable[[str], Extent]) -> Extent:
    """Return the extent of a field; `extent_of` returns that of a nested type."""
    inner = Extent(_SIZES[kind.base], 1, 0, 0) if kind.is_builtin else extent_of(kind.base)
    if not kind.is_array:
        return inner
    size = _LENGTH_SIZE if kind.length is None else kind.length * max(inner.size, 1)
    loops = inner.loops + (kind.base not in STRUCT_CODES)
    return inner._replace(size=size, loops=loops)


def message_extent(fields: Iterable[Extent]) -> Extent:
    """Return the extent of a message of these fields."""
    every = list(fields)
    return Extent(
        sum(field.size for field in every),
        sum(field.fields for field in every),
        1 + max((field.depth for field in every), default=0),
        max((field.loops for field in every), default=0),
    )


def find_excess(extent: Extent) -> tuple[str, str] | None:
    """Return the attribute of a message's extent that is too large, and the problem, or None."""
    problems = {
        "fields": (MAX_FIELDS, "fields, nested ones counted"),
        "depth": (MAX_TYPE_NESTING, NESTED),
        "loops": (MAX_ARRAY_NESTING, "arrays in one another"),
    }
    for attribute, (most, what) in problems.items():
        if (value := getattr(extent, attribute)) > most:
            return attribute, too_many(f"{value:,}", what, most)
    return ("size", too_large(f"{extent.size:,} bytes")) if extent.size > LARGEST else None


def too_many(got: str, what: str, most: int) -> str:
    """Return the problem of a count."""
    return f"got {got} {what}; expected {most:,} at most"


def too_large(what: str) -> str:
    """Return the problem of a message of a size."""
    return (
        f"got a message of {what} at least; expected {LARGEST:,} bytes at most. Try an array "
        "without a length"
    )
