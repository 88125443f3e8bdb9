"""Reads CSV files like the equivalent YAML file: as a list of mappings, with line numbers."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import TYPE_CHECKING, Final

from ruamel.yaml.comments import CommentedMap

from actionlib_core.yaml_text import load_yaml
from smachpy.sim.checked_yaml import Problem
from smachpy.sim.exceptions import InputFileError

if TYPE_CHECKING:
    from collections.abc import Container, Iterator
    from pathlib import Path

_EXPECTED: Final = "a header line that names the columns, such as name,x,y,yaw"


def read_csv(path: Path, key: str, texts: Container[str] = ()) -> CommentedMap:
    """Return the rows of a CSV file as a list of mappings under `key`, without empty cells.

    Numeric cells become numbers, except in the columns of `texts`. Blank lines and lines that begin
    with # are skipped, except inside quotes, where they belong to the cell.

    Raises:
        InputFileError: it cannot be read, or the rows do not fit the header line.
    """
    name = str(path)
    try:
        text = path.read_bytes().decode("utf-8-sig")
        table = list(_records(text))
    except csv.Error as error:
        problem = Problem(name, 0, "", f"a mistake ({error})", "valid CSV")
        raise InputFileError([problem]) from error
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "bytes that are no UTF-8 text"
        problem = Problem(name, 0, "", f"'{reason}'", "a readable CSV file")
        raise InputFileError([problem]) from error
    if not table:
        raise InputFileError([Problem(name, 1, "", "an empty file", _EXPECTED)])
    (line, header), *body = table
    problems = _header_problems(name, line, header)
    for number, cells in body:
        if len(cells) > len(header):
            got, expected = f"{len(cells)} cells", f"at most {len(header)}, as in line {line}"
            problems.append(Problem(name, number, "", got, expected))
    if problems:
        raise InputFileError(problems)
    return _as_yaml(key, (line, header), body, texts)


def _records(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each record with the number of its first line.

    Raises:
        csv.Error: a quote is not closed, or a cell is too long.
    """
    inside, first = False, 0

    def lines() -> Iterator[str]:
        nonlocal inside, first
        for number, line in enumerate(io.StringIO(text, newline=""), 1):
            if not inside:
                if not line.strip() or line.lstrip().startswith("#"):
                    continue
                inside, first = True, number  # until the reader returns the record
            yield line

    for cells in csv.reader(lines(), skipinitialspace=True, strict=True):
        inside = False
        yield first, [cell.strip(" \t") for cell in cells]


def _header_problems(name: str, line: int, header: list[str]) -> list[Problem]:
    if any(_number(cell) is not None or not cell for cell in header):
        return [Problem(name, line, "", repr(",".join(header)), _EXPECTED)]
    twice = sorted({cell for cell in header if header.count(cell) > 1})
    return [Problem(name, line, cell, "two columns of this name", "one") for cell in twice]


def _as_yaml(
    key: str,
    columns: tuple[int, list[str]],
    rows: list[tuple[int, list[str]]],
    texts: Container[str],
) -> CommentedMap:
    """Return the rows as YAML with the same line numbers as the CSV file, for errors."""
    at, header = columns
    lines = [""] * (at - 1) + [f"{_quoted(key)}:{'' if rows else ' []'}"]
    for number, cells in rows:
        row = {column: cell for column, cell in zip(header, cells, strict=False) if cell}
        values = {c: cell if c in texts else _number(cell) for c, cell in row.items()}
        lines += [""] * (number - len(lines) - 1)
        pairs = (f"{_quoted(c)}: {_as_scalar(row[c], v)}" for c, v in values.items())
        lines.append(f"- {{{', '.join(pairs)}}}")
    data = load_yaml("\n".join(lines), "rt")
    assert isinstance(data, CommentedMap)
    return data


def _as_scalar(cell: str, value: str | float | None) -> str:
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else f"{value:+}".replace("inf", ".inf")
    return _quoted(cell) if value is None or isinstance(value, str) else json.dumps(value)


def _number(cell: str) -> int | float | None:
    if not cell.isascii() or "_" in cell:  # Python's int() accepts "1_000" and other digits
        return None
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return None


def _quoted(text: str) -> str:
    """Return a text as a YAML string; JSON would split characters beyond U+FFFF in two."""
    inside = (f"\\U{ord(c):08x}" if c > "\uffff" else json.dumps(c)[1:-1] for c in text)
    return f'"{"".join(inside)}"'
