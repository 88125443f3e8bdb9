"""Parses CSV like the equivalent YAML: a list of mappings, and the line of each."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Container, Iterator

    from actionlib_core.inputs.checked_file import CheckedFile, Parsed

_EXPECTED: Final = "a header line that names the columns, such as name,x,y,yaw"


def parse_csv(file: CheckedFile, text: str, key: str, texts: Container[str]) -> Parsed:
    """Return the rows of a CSV text as a list of mappings under `key`, without empty cells.

    Numeric cells become numbers, except in the columns of `texts`. Blank lines and lines that begin
    with # are skipped, except inside quotes, where they belong to the cell. Rows that do not fit
    the header line are reported.
    """
    try:
        (at, header), *body = [*_records(text)] or [(1, [])]
    except csv.Error as error:
        file.report("", f"not CSV: {error}.", 0)
        return None, {}
    if not header or any(not cell or _value(cell) != cell for cell in header):
        got = repr(",".join(header)) if header else "an empty file"
        file.report("", f"got {got}; expected {_EXPECTED}.", at)
    for cell in sorted({cell for cell in header if header.count(cell) > 1}):
        file.report(cell, "got two columns of this name; expected one.", at)
    lines = {key: at}
    rows: list[dict[str, object]] = []
    for number, cells in body:
        if len(cells) > len(header):
            expected = f"at most {len(header)}, as in line {at}"
            file.report("", f"got {len(cells)} cells; expected {expected}.", number)
        row = {column: cell for column, cell in zip(header, cells, strict=False) if cell}
        lines[f"{key}[{len(rows)}]"] = number
        rows.append({c: cell if c in texts else _value(cell) for c, cell in row.items()})
    return {key: rows}, lines


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


def _value(cell: str) -> int | float | str:
    if not cell.isascii() or "_" in cell:  # Python's int() accepts "1_000" and other digits
        return cell
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            pass
    return cell
