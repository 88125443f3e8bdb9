"""CSV files read as the YAML file that says the same: a list of mappings, with their lines."""

from __future__ import annotations

import csv
from typing import TYPE_CHECKING, Final

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from missions.checked_yaml import Problem
from missions.exceptions import InputFileError

if TYPE_CHECKING:
    from collections.abc import Container
    from pathlib import Path

_EXPECTED: Final = "a header line that names the columns, such as name,x,y,yaw"


def read_csv(path: Path, key: str, texts: Container[str] = ()) -> CommentedMap:
    """Return the rows of a CSV file as a list of mappings under `key`; empty cells are left out.

    Cells that are numbers become numbers, except in the columns named in `texts`. Blank lines and
    lines that begin with # are skipped.

    Raises:
        InputFileError: it cannot be read, or the rows do not fit the header line.
    """
    name = str(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "bytes that are no UTF-8 text"
        problem = Problem(name, 0, "", f"'{reason}'", "a readable CSV file")
        raise InputFileError([problem]) from error
    table = [(i, _cells(line)) for i, line in enumerate(lines, 1) if _says_something(line)]
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
    top = CommentedMap({key: _rows(header, body, texts)})
    top.lc.line = top.lc.col = 0
    top._yaml_set_kv_line_col(key, [line - 1, 0, line - 1, 0])  # noqa: SLF001  as YAML's loader does
    return top


def _says_something(line: str) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith("#")


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([line], skipinitialspace=True))]


def _header_problems(name: str, line: int, header: list[str]) -> list[Problem]:
    if any(_number(cell) is not None or not cell for cell in header):
        return [Problem(name, line, "", repr(",".join(header)), _EXPECTED)]
    twice = sorted({cell for cell in header if header.count(cell) > 1})
    return [Problem(name, line, cell, "two columns of this name", "one") for cell in twice]


def _rows(
    header: list[str], body: list[tuple[int, list[str]]], texts: Container[str]
) -> CommentedSeq:
    rows = CommentedSeq()
    for i, (number, cells) in enumerate(body):
        row = CommentedMap()
        for column, cell in zip(header, cells, strict=False):
            if cell:
                value = None if column in texts else _number(cell)
                row[column] = cell if value is None else value
                place = [number - 1, 0, number - 1, 0]
                row._yaml_set_kv_line_col(column, place)  # noqa: SLF001  as above
        rows.append(row)
        rows._yaml_set_idx_line_col(i, [number - 1, 0])  # noqa: SLF001  as above
    return rows


def _number(cell: str) -> int | float | None:
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return None
