"""Reads YAML files and reports all problems at once, each with file, line and field."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from actionlib_core.suggest import did_you_mean
from actionlib_core.yaml_text import YamlTextError, load_yaml
from smachpy.sim.exceptions import InputFileError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

REQUIRED: Final = object()  # the default of a required field


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
            is_finite(value)
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


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem in a file.

    Attributes:
        file: The file as the user named it.
        line: Line number from 1; 0 for the whole file.
        field: Dotted path of the field; "" for the whole file.
        got: The value.
        expected: What was expected.
        hint: A sentence with advice; may be "".
    """

    file: str
    line: int
    field: str
    got: str
    expected: str
    hint: str = ""

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        what = f"{where}: {self.field}" if self.field else where
        hint = f" {self.hint}" if self.hint else ""
        return f"{what}: got {self.got}; expected {self.expected}.{hint}"


class Section:
    """One mapping of a YAML file.

    Its getters never raise: they record a problem and return a harmless value, so that one pass
    finds all problems. `Document.check` raises them at the end.
    """

    def __init__(self, document: Document, field: str, data: CommentedMap, line: int) -> None:
        self._document = document
        self._field = field
        self._data = data
        self._line = line
        self._seen: set[str] = set()

    def __contains__(self, key: str) -> bool:
        return key in self._data

    @property
    def problem_count(self) -> int:
        """The number of problems in the file so far."""
        return len(self._document.problems)

    def path(self, key: str) -> str:
        """Return the dotted path of `key` in the file."""
        return f"{self._field}.{key}" if self._field else key

    def line(self, key: str) -> int:
        """Return the line of `key`; that of the section if the key is missing."""
        try:
            return int(self._data.lc.key(key)[0]) + 1
        except (KeyError, TypeError):  # a mapping that is not from the file has no line numbers
            return self._line

    def problem(self, key: str, expected: str, hint: str = "") -> None:
        """Record a problem with the value of `key`."""
        got = repr(_plain(self._data[key])) if key in self._data else "nothing"
        self._document.problems.append(
            Problem(self._document.name, self.line(key), self.path(key), got, expected, hint)
        )

    def number(
        self, key: str, default: object, limits: Limits = ANY_NUMBER, unit: str = ""
    ) -> float:
        """Return a number; `default` when `key` is absent."""
        value = self._take(key, default)
        expected = _join("a number", f"[{unit}]" if unit else "", limits.text())
        if value is _ABSENT:
            self.problem(key, expected)
        elif _is_number(value) and limits.allow(value):  # type: ignore[arg-type]
            return float(value)  # type: ignore[arg-type]
        else:
            self.problem(key, expected)
        return 1.0

    def integer(self, key: str, default: object, limits: Limits = ANY_NUMBER) -> int:
        """Return a whole number; `default` when `key` is absent."""
        value = self._take(key, default)
        if isinstance(value, int) and not isinstance(value, bool) and limits.allow(value):
            return int(value)
        self.problem(key, _join("a whole number", limits.text()))
        return 1

    def flag(self, key: str, default: object) -> bool:
        """Return true or false; 1 and 0 count too, as map_server writes them."""
        value = self._take(key, default)
        if isinstance(value, int) and value in {0, 1}:
            return bool(value)
        self.problem(key, "true or false")
        return False

    def text(self, key: str, default: object, choices: Sequence[str] = ()) -> str:
        """Return a non-empty text; one of `choices`, if given."""
        value = self._take(key, default)
        if isinstance(value, str) and value.strip() and (not choices or value in choices):
            return str(value)
        expected = "one of " + ", ".join(choices) if choices else "a text"
        hint = did_you_mean(value, choices).lstrip() if isinstance(value, str) else ""
        self.problem(key, expected, hint)
        return choices[0] if choices else "-"

    def numbers(self, key: str, default: object, names: Sequence[str]) -> tuple[float, ...]:
        """Return a list of numbers, one for each of `names`."""
        value = self._take(key, default)
        good = (
            isinstance(value, list | tuple)
            and len(value) == len(names)
            and all(_is_number(v) and is_finite(v) for v in value)
        )
        if good:
            return tuple(float(v) for v in value)  # type: ignore[attr-defined]
        self.problem(key, f"{len(names)} numbers [{', '.join(names)}]")
        return (0.0,) * len(names)

    def section(self, key: str) -> Section:
        """Return a mapping inside this one; an empty one when `key` is absent."""
        value = self._take(key, None)
        if isinstance(value, CommentedMap):
            return Section(self._document, self.path(key), value, self.line(key))
        if value is not None:
            self.problem(key, "a mapping (name: value lines, indented)")
        return Section(self._document, self.path(key), CommentedMap(), self.line(key))

    def rows(self, key: str) -> list[Section]:
        """Return the mappings of the list under `key`, which must not be empty."""
        value = self._take(key, REQUIRED)
        if not isinstance(value, CommentedSeq) or not value:
            self.problem(key, "a list with at least one entry (lines that start with '- ')")
            return []
        rows = []
        for i, entry in enumerate(value):
            field, line = f"{self.path(key)}[{i}]", int(value.lc.item(i)[0]) + 1
            if isinstance(entry, CommentedMap):
                rows.append(Section(self._document, field, entry, line))
            else:
                got = repr(_plain(entry))
                self._document.problems.append(
                    Problem(self._document.name, line, field, got, "a mapping (name: value)")
                )
        return rows

    def allow(self, *keys: str) -> None:
        """Count `keys` as known: optional keys that are read only if present."""
        self._seen.update(keys)

    def close(self) -> None:
        """Record a problem for each key that was not read."""
        for key in self._data:
            if key not in self._seen:
                hint = did_you_mean(key, sorted(self._seen)).lstrip()
                self._document.problems.append(
                    Problem(
                        self._document.name,
                        self.line(key),
                        self.path(str(key)),
                        "an unknown field",
                        "one of " + ", ".join(sorted(self._seen)),
                        hint,
                    )
                )

    def _take(self, key: str, default: object) -> object:
        self._seen.add(key)
        if key in self._data:
            return self._data[key]
        return _ABSENT if default is REQUIRED else default


class Document:
    """A YAML file with a mapping at the top, or a CSV file, whose rows become a list in one.

    Attributes:
        name: The file as the user named it.
        problems: The problems so far.
        top: The mapping.
    """

    def __init__(self, path: Path, csv_rows: str = "", csv_texts: Sequence[str] = ()) -> None:
        """Read `path`.

        Args:
            path: The file.
            csv_rows: The key for the rows of a CSV file; "": a CSV file is not accepted.
            csv_texts: Columns of a CSV file that are text, even if they look like numbers.

        Raises:
            InputFileError: it cannot be read or is not YAML with a mapping at the top.
        """
        self.name = str(path)
        self.problems: list[Problem] = []
        self.top = Section(self, "", self._read(path, csv_rows, csv_texts), 1)

    def check(self) -> None:
        """Raise the problems, if there are any.

        Raises:
            InputFileError: with all problems.
        """
        if self.problems:
            raise InputFileError(self.problems)

    def _read(self, path: Path, csv_rows: str, csv_texts: Sequence[str]) -> CommentedMap:
        if csv_rows and path.suffix.lower() == ".csv":
            from smachpy.sim.checked_csv import read_csv

            return read_csv(path, csv_rows, csv_texts)
        return self._load(path)

    def _load(self, path: Path) -> CommentedMap:
        try:
            data = load_yaml(path.read_text(encoding="utf-8"), "rt")
        except YamlTextError as error:
            got = f"a mistake ({error.reason})"
            raise InputFileError([Problem(self.name, error.line, "", got, "valid YAML")]) from error
        except UnicodeDecodeError as error:
            got = "bytes that are no UTF-8 text"
            raise InputFileError([Problem(self.name, 0, "", got, "valid YAML")]) from error
        except OSError as error:
            reason = error.strerror or str(error)
            problem = Problem(self.name, 0, "", f"'{reason}'", "a readable YAML file")
            raise InputFileError([problem]) from error
        if isinstance(data, CommentedMap):
            return data
        got = "an empty file" if data is None else f"a {type(data).__name__}"
        expected = "a mapping at the top (name: value lines)"
        raise InputFileError([Problem(self.name, 1, "", got, expected)])


def is_finite(value: float) -> bool:
    """Return whether `value` is a finite number that fits a float."""
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max


class _Absent:
    def __repr__(self) -> str:
        return "nothing"


_ABSENT: Final = _Absent()


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _plain(value: object) -> object:
    """Return YAML data as plain Python data, for messages."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_plain(v) for v in value]
    if isinstance(value, float):
        return float(value)
    return str(value) if isinstance(value, str) else value


def _join(*parts: str) -> str:
    return " ".join(part for part in parts if part)
