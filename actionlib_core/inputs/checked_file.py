"""Checks the files that people write: all mistakes of a file come at once, each with its line.

A reader opens a `CheckedFile`, takes what it needs from its sections in plain code, and ends with
`check`, which raises the reader's own exception if anything was wrong:

    file = CheckedFile(path, MyError)
    speed = file.top.number("speed", 0.8, Limits(above=0, high=10), "m/s")
    file.top.close()
    file.check()

Read in this way are configurations of the network, parameters of robots, worlds, maps, places (as
YAML or CSV), mapping files of Petri Net Plans, files of ROS 1 parameters, and the settings of
`smachpy check` in pyproject.toml.

Other files have their own readers, for these reasons:

- Recordings, journals and other JSON are written by programs. They are only wrong if they are
  damaged, and what follows the damage means nothing: the first problem is the only one.
- Plans (PNML, text) are graphs. Their problems belong to nodes, not fields, some are only warnings,
  and the checks of the net add theirs to the same list (`smachpy.pnp.problems`).
- Values of messages, in YAML too, are checked by the class of the message (`FieldError`). Like the
  forms of the live page, they are no files: they have no lines and mostly a few fields.
"""

from __future__ import annotations

import dataclasses
import errno
import sys
from dataclasses import MISSING, dataclass
from functools import partial
from typing import (
    TYPE_CHECKING,
    Any,
    Final,
    Literal,
    TypeAlias,
    get_args,
    get_origin,
    get_type_hints,
)

from actionlib_core.inputs.suggest import did_you_mean, nearest
from actionlib_core.inputs.yaml_text import YamlTextError, load_with_lines

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path


REQUIRED: Final = object()
"""The default of a field that must be in the file."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The range of a number; None leaves a side open.

    Attributes:
        low: Smallest value allowed.
        above: The value must be greater than this.
        high: Largest value allowed.
    """

    low: float | None = None
    above: float | None = None
    high: float | None = None

    def allow(self, value: float) -> bool:
        """Return whether `value` is in the range; a value that is not finite never is."""
        return (
            abs(value) <= sys.float_info.max  # false for nan, and for an integer beyond all floats
            and (self.low is None or value >= self.low)
            and (self.above is None or value > self.above)
            and (self.high is None or value <= self.high)
        )

    def text(self) -> str:
        """Describe the limits: "> 0, at most 3"."""
        parts = [] if self.above is None else [f"> {self.above:g}"]
        parts += [] if self.low is None else [f"at least {self.low:g}"]
        parts += [] if self.high is None else [f"at most {self.high:g}"]
        return ", ".join(parts)


ANY_NUMBER: Final = Limits()
MAX_BYTES: Final = 16 << 20  # far more than people write; a device such as /dev/zero never ends
MAX_PROBLEMS: Final = 100  # of one file; the rest is mostly the same again
_MAPPING: Final = "a mapping of names to values"


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem in a file.

    Attributes:
        file: The file as the user named it.
        line: Line number from 1; 0 for the whole file.
        field: Path of the field, "robots[0].x"; "" for the whole file.
        text: What is wrong: "got 3; expected a text."
    """

    file: str
    line: int
    field: str
    text: str

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        return ": ".join(part for part in (where, self.field, self.text) if part)


Parsed: TypeAlias = "tuple[object, dict[str, int]]"
"""The data in a text, and the line of each field by its path."""


def read_limited(path: str | Path, most: int = MAX_BYTES) -> bytes:
    """Return the content of a file.

    Raises:
        OSError: it cannot be read, or has more than `most` bytes, as a device that never ends.
    """
    with open(path, "rb") as opened:  # noqa: PTH123  `path` may be a text
        content = opened.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"more than {most:,} bytes", str(path))
    return content


def parse_yaml(file: CheckedFile, text: str) -> Parsed:
    """Return the data in a YAML text; report it if it is none."""
    try:
        return load_with_lines(text)
    except YamlTextError as error:
        file.report("", f"not YAML: {error.reason}.", error.line)
        return None, {}


class CheckedFile:
    """A file with a mapping at the top, usually YAML.

    Attributes:
        name: The file as the user named it.
        folder: The folder that it is in.
        problems: The problems so far; those of a file that it names can be among them.
        bad_fields: The fields with a problem of their own, or whose name is misspelt.
        top: The mapping.
    """

    def __init__(
        self,
        path: Path,
        error: Callable[[Sequence[Problem]], Exception],
        parse: Callable[[CheckedFile, str], Parsed] = parse_yaml,
        *,
        may_be_empty: bool = False,
    ) -> None:
        """Read `path`.

        Args:
            path: The file.
            error: Makes the exception for its problems.
            parse: Returns what is in a text; reports what is wrong with it.
            may_be_empty: A file without any value counts as an empty mapping.

        Raises:
            Exception: that of `error`: the file cannot be read, or has no mapping at the top.
        """
        self.name = str(path)
        self.folder = path.parent
        self.problems: list[Problem] = []
        self.bad_fields: set[str] = set()
        self._error = error
        self._lines: dict[str, int] = {}
        try:
            # Not `read_text`, which changes line ends, also those inside the cells of a CSV file.
            content = read_limited(path)
            data, self._lines = parse(self, content.decode("utf-8-sig"))
        except (OSError, UnicodeDecodeError) as reason:
            got = repr(reason.strerror) if isinstance(reason, OSError) else "no UTF-8"
            line = 0
            if isinstance(reason, UnicodeDecodeError):
                line = reason.object.count(b"\n", 0, reason.start) + 1
            self.report("", f"got {got}; expected a readable text.", line)
            raise error(self.problems) from reason
        self.check()
        if data is None and may_be_empty:
            data = {}
        if not isinstance(data, dict):
            got = "an empty file" if data is None else f"a {type(data).__name__}"
            self.report("", f"got {got}; expected {_MAPPING}.")
        self.check()
        self.top = Section(self, "", data)

    def report(self, field: str, text: str, line: int | None = None) -> None:
        """Add a problem; `line` is that of the field unless it is given."""
        line = self.line(field) if line is None else line
        if len(self.problems) >= MAX_PROBLEMS:
            text, field = f"more than {MAX_PROBLEMS} problems; the rest is not listed.", ""
            self.problems.append(Problem(self.name, line, field, text))
            self.check()
        self.problems.append(Problem(self.name, line, field, text))
        self.bad_fields.add(field)

    def line(self, field: str) -> int:
        """Return the line of a field; that of what it would be in if it is missing."""
        while field and field not in self._lines:
            field = field[: max(field.rfind("."), field.rfind("["), 0)]
        return self._lines.get(field, 1)

    def is_good(self, field: str) -> bool:
        """Return whether a field has no problem so far, nor anything in it or around it."""
        return not any(_is_in(field, bad) or _is_in(bad, field) for bad in self.bad_fields)

    def check(self) -> None:
        """Raise the problems in the order of the file, if there are any.

        Raises:
            Exception: that of the file.
        """
        if self.problems:
            problems = dict.fromkeys(self.problems)  # two fields may name one file
            raise self._error(sorted(problems, key=lambda p: (p.file != self.name, p.file, p.line)))


class Section:
    """A mapping in a file.

    Its getters report a problem and return a harmless value, so that one pass finds all problems;
    they raise only when there are more than `MAX_PROBLEMS`.

    Attributes:
        file: The file.
    """

    def __init__(self, file: CheckedFile, field: str, data: object) -> None:
        # With something else than a mapping here, what is missing in it is not worth reporting.
        self._is_mapping = isinstance(data, dict)
        self._data = (
            {str(key): value for key, value in data.items()} if isinstance(data, dict) else {}
        )
        self.file = file
        self._field = field
        self._seen: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self._data

    def __iter__(self) -> Iterator[str]:
        return iter(self._data)

    def path(self, key: str) -> str:
        """Return the path of `key` in the file."""
        dot = "." if self._field and key and not key.startswith("[") else ""
        return f"{self._field}{dot}{key}"

    def line(self, key: str) -> int:
        """Return the line of `key`; that of the section if it is missing."""
        return self.file.line(self.path(key))

    def report(self, key: str, text: str) -> None:
        """Report a problem with `key`, or with this section if `key` is empty.

        A field has one problem at most: a second one is mostly a consequence of the first.
        """
        if self._is_mapping and self.path(key) not in self.file.bad_fields:
            self.file.report(self.path(key), text)

    def report_each(self, problems: Iterable[str]) -> None:
        """Report what a class says of its arguments, "name: text", unless it is known already."""
        for problem in problems:
            key, _, text = problem.partition(": ")
            if self.is_good(key):
                self.report(key, text)

    def problem(self, key: str, expected: str, hint: str = "") -> None:
        """Report that the value of `key` is not what was expected; a hint is a sentence."""
        got = _shown(self._data[key]) if key in self else "nothing"
        self.report(key, f"got {got}; expected {expected}.{hint and ' '}{hint}")

    def is_good(self, *keys: str) -> bool:
        """Return whether nothing in these keys has a problem so far."""
        return all(self.file.is_good(self.path(key)) for key in keys)

    def value(self, key: str, default: object = None) -> Any:
        """Return any value, unchecked."""
        self._seen.add(key)
        return self._data.get(key, default)

    def number(
        self, key: str, default: object, limits: Limits = ANY_NUMBER, unit: str = ""
    ) -> float:
        """Return a number; `default` when `key` is absent."""
        value = self.value(key, default)
        if _is_number(value) and limits.allow(value):
            return float(value)
        self.problem(key, _join("a number", unit and f"[{unit}]", limits.text()))
        return 1.0

    def integer(self, key: str, default: object, limits: Limits = ANY_NUMBER) -> int:
        """Return a whole number; `default` when `key` is absent."""
        value = self.value(key, default)
        if _is_number(value) and isinstance(value, int) and limits.allow(value):
            return value
        self.problem(key, _join("a whole number", limits.text()))
        return 1

    def flag(self, key: str, default: object) -> bool:
        """Return true or false; 1 and 0 count too, as map_server writes them."""
        value = self.value(key, default)
        if isinstance(value, int) and value in {0, 1}:
            return bool(value)
        self.problem(key, "true or false")
        return False

    def text(
        self, key: str, default: object, choices: Sequence[str] = (), *, may_be_blank: bool = False
    ) -> str:
        """Return a text; one of `choices`, if given."""
        value = self.value(key, default)
        is_text = isinstance(value, str) and (may_be_blank or bool(value.strip()))
        if is_text and (not choices or value in choices):
            return str(value)
        expected = f"one of {sorted(choices)}" if choices else "a text"
        hint = did_you_mean(value, choices).lstrip() if isinstance(value, str) else ""
        self.problem(key, expected, hint)
        return choices[0] if choices else "-"

    def numbers(self, key: str, default: object, names: Sequence[str]) -> tuple[float, ...]:
        """Return a list of numbers, one for each of `names`."""
        value = self.value(key, default)
        if (
            isinstance(value, list | tuple)
            and len(value) == len(names)
            and all(_is_number(v) and ANY_NUMBER.allow(v) for v in value)
        ):
            return tuple(float(v) for v in value)
        self.problem(key, f"{len(names)} numbers [{', '.join(names)}]")
        return (0.0,) * len(names)

    def texts(self, key: str, default: object, choices: Sequence[str] = ()) -> tuple[str, ...]:
        """Return a list of texts; each one of `choices`, if given."""
        value, expected = self.value(key, default), "a list of texts"
        if isinstance(value, str):
            self.problem(key, expected, f"Try [{value!r}].")
        entries = self._entries(key, default, expected)
        return tuple(entries.text(i, REQUIRED, choices, may_be_blank=True) for i in entries)

    def section(self, key: str) -> Section:
        """Return a mapping inside this one; an empty one when `key` is absent."""
        value = self.value(key)
        if value is None:
            value = {}
        if not isinstance(value, dict):
            self.problem(key, _MAPPING)
        return Section(self.file, self.path(key), value if self._is_mapping else None)

    def rows(self, key: str, default: object = REQUIRED) -> list[Section]:
        """Return the mappings in a list, which must not be empty unless there is a default."""
        expected = "a list with at least one entry" if default is REQUIRED else "a list of mappings"
        entries = self._entries(key, default, expected, least=int(default is REQUIRED))
        return [entries.section(i) for i in entries]

    def values(self, kind: type, **given: object) -> dict[str, Any]:
        """Return fields of a dataclass by the types that it declares: those `given`, those here.

        The getters above are chosen by type: numbers (the field's metadata may have "limits" and
        "unit"), true or false, texts, a `Literal`, a tuple of texts. The caller reads the fields
        of other types. A field that is wrong is left out if it has a default.
        """
        hints = get_type_hints(kind)
        found = dict(given)
        for item in dataclasses.fields(kind):
            get = self._getter(hints[item.name], item.metadata)
            if get is None or item.name in given:
                continue
            self.allow(item.name)
            required = item.default is MISSING and item.default_factory is MISSING
            if item.name in self or required:
                value = get(item.name, REQUIRED)
                if self.is_good(item.name) or required:
                    found[item.name] = value
        return found

    def allow(self, *keys: str) -> None:
        """Count `keys` as known: optional keys that are read only if present."""
        self._seen.update(keys)

    def close(self) -> None:
        """Report each key that was not read."""
        known = sorted(self._seen)
        for key in [key for key in self if key not in self._seen]:
            hint = did_you_mean(key, known)
            self.report(key, f"got an unknown field; expected one of {known}.{hint}")
            # The one that was meant is not missing.
            meant = [self.path(near) for near in nearest(key, known) if near not in self]
            self.file.bad_fields.update(meant)

    def _getter(
        self, hint: Any, metadata: Mapping[str, Any]
    ) -> Callable[[str, object], object] | None:
        if get_origin(hint) is Literal:
            return partial(self.text, choices=get_args(hint))
        limits = metadata.get("limits", ANY_NUMBER)
        getters: dict[Any, Callable[[str, object], object]] = {
            float: partial(self.number, limits=limits, unit=metadata.get("unit", "")),
            int: partial(self.integer, limits=limits),
            bool: self.flag,
            str: partial(self.text, may_be_blank=True),
            tuple[str, ...]: self.texts,
        }
        return getters.get(hint)

    def _entries(self, key: str, default: object, expected: str, least: int = 0) -> Section:
        """Return a list as a section with the keys "[0]", "[1]", ..."""
        value = self.value(key, default)
        if isinstance(value, list | tuple) and len(value) >= least:
            data = {f"[{i}]": entry for i, entry in enumerate(value)}
            return Section(self.file, self.path(key), data)
        self.problem(key, expected)
        return Section(self.file, self.path(key), None)


def _is_in(inner: str, outer: str) -> bool:
    return inner == outer or inner.startswith((f"{outer}.", f"{outer}["))


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shown(value: object) -> str:
    try:
        return repr(value)
    except ValueError:  # Python refuses to write integers of more than 4300 digits
        return "a number with too many digits"


def _join(*parts: str) -> str:
    return " ".join(part for part in parts if part)
