"""A message as text for the terminal: YAML, CSV or JSON, complete or shortened, or one field."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from typing import TYPE_CHECKING, Any

from actionlib_core.cli._command import json_text
from actionlib_core.exceptions import ActionlibError

if TYPE_CHECKING:
    import argparse

    from actionlib_core.interfaces import Message

_STEP = re.compile(r"\.?(?P<field>[A-Za-z_]\w*)|\[(?P<index>-?[0-9]{1,9})\]")


class FieldPathError(ActionlibError, ValueError):
    """A path that does not lead to a field of a message.

    Try: `actionlib interface show TYPE` shows the fields; a path is `a.b[0].c`.
    """


class MessageText:
    """Formats messages according to the options of `topic echo`.

    Args:
        args: `field`, `csv`, `json`, `no_arr`, `no_str`, `flow_style`, `full_length`,
            `truncate_length`.
    """

    def __init__(self, args: argparse.Namespace) -> None:
        self._args = args
        self._path = split_path(args.field) if args.field else []
        self._limit = None if args.full_length else args.truncate_length

    def format(self, message: Message) -> str:
        """Return the text of one message.

        Raises:
            FieldPathError: there is no such field.
        """
        args = self._args
        value = follow(message.to_dict(), self._path, args.field or "")
        if args.json:
            return json_text(value)
        value = shorten(value, self._limit, no_arr=args.no_arr, no_str=args.no_str)
        if args.csv:
            return _csv_line(flatten(value))
        return f"{to_yaml(value, flow=args.flow_style)}\n---"


def split_path(path: str) -> list[str | int]:
    """Return the steps of a path: "pose.position[0].x" is ["pose", "position", 0, "x"].

    Raises:
        FieldPathError: it is not a path.
    """
    steps: list[str | int] = []
    position = 0
    while position < len(path):
        match = _STEP.match(path, position)
        if match is None:
            raise FieldPathError(
                f"field path: malformed at {position}: got {path!r}; expected names and [indices], "
                "pose.position.x or ranges[0] for example."
            )
        steps.append(match["field"] or int(match["index"]))
        position = match.end()
    return steps


def follow(value: Any, steps: list[str | int], path: str) -> Any:
    """Return the value at the end of a path.

    Raises:
        FieldPathError: there is no such field or item.
    """
    for step in steps:
        try:
            value = value[step]
        except (KeyError, IndexError, TypeError):
            there = sorted(value) if isinstance(value, dict) else "no fields"
            raise FieldPathError(
                f"field path {path!r}: {step!r} is not there; there are {there}."
            ) from None
    return value


def shorten(value: Any, limit: int | None, *, no_arr: bool, no_str: bool) -> Any:
    """Return plain data with long arrays and texts cut.

    Args:
        value: Nested dicts, lists and scalars.
        limit: Longest array or text; None: no limit.
        no_arr: Show only the lengths of arrays.
        no_str: Show only the lengths of texts.
    """
    if isinstance(value, dict):
        return {
            key: shorten(item, limit, no_arr=no_arr, no_str=no_str) for key, item in value.items()
        }
    if isinstance(value, (list, tuple)):
        if no_arr:
            return f"<array length: {len(value)}>"
        cut = value if limit is None else value[:limit]
        items = [shorten(item, limit, no_arr=no_arr, no_str=no_str) for item in cut]
        return [*items, "..."] if len(cut) < len(value) else items
    if isinstance(value, str):
        if no_str:
            return f"<string length: {len(value)}>"
        return value if limit is None or len(value) <= limit else f"{value[:limit]}..."
    return value


def flatten(value: Any) -> list[Any]:
    """Return the scalars of plain data, in order."""
    if isinstance(value, dict):
        return [scalar for item in value.values() for scalar in flatten(item)]
    if isinstance(value, list):
        return [scalar for item in value for scalar in flatten(item)]
    return [value]


def _csv_line(values: list[Any]) -> str:
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="").writerow(values)
    return buffer.getvalue()


def to_yaml(value: Any, *, flow: bool = False) -> str:
    """Return plain data as YAML: arrays of scalars on one line; with `flow`, everything."""
    return _flow(value) if flow else "\n".join(_block(value, ""))


def _block(value: Any, indent: str) -> list[str]:
    if isinstance(value, dict) and value:
        return [
            line
            for key, item in value.items()
            for line in _under(f"{indent}{key}:", item, f"{indent}  ")
        ]
    if isinstance(value, list) and any(isinstance(item, (dict, list)) for item in value):
        return [line for item in value for line in _item(item, indent)]
    return [f"{indent}{_flow(value)}"]


def _under(head: str, value: Any, indent: str) -> list[str]:
    lines = _block(value, indent)
    nested = isinstance(value, (dict, list)) and lines != [f"{indent}{_flow(value)}"]
    return [head, *lines] if nested else [f"{head} {_flow(value)}"]


def _item(value: Any, indent: str) -> list[str]:
    first, *others = _block(value, f"{indent}  ")
    return [f"{indent}- {first.lstrip()}", *others]


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return f"[{', '.join(map(_flow, value))}]"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return json.dumps(value)
