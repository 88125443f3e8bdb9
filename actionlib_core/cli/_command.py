"""Common parts of the commands: parsers, and output as YAML or JSON."""

from __future__ import annotations

import contextlib
import json
import math
import textwrap
from typing import TYPE_CHECKING, Any

from actionlib_core.process.output import discard_output

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterator


def add_command(
    verbs: Any, name: str, run: Callable[[argparse.Namespace], int], help_: str, **more: Any
) -> argparse.ArgumentParser:
    """Add a command with its `--json` to an argparse subparsers object; returns its parser."""
    parser: argparse.ArgumentParser = verbs.add_parser(name, help=help_, **more)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)
    return parser


def json_text(value: Any) -> str:
    """Return a value with the content of messages as JSON. JSON has no NaN or infinity: null."""
    try:
        return json.dumps(value, allow_nan=False)
    except ValueError:
        return json.dumps(_without_nan(value))


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_json(**fields: Any) -> None:
    """Print a JSON object on one line, and flush it."""
    print(json_text(fields), flush=True)


def print_message(title: str, message: Any) -> None:
    """Print a title, a message as indented YAML, and an empty line."""
    print(f"{title}\n{textwrap.indent(message.to_yaml().rstrip() or '{}', '    ')}\n", flush=True)


def print_progress(args: argparse.Namespace, text: str) -> None:
    """Print the progress of a command, except with `--json`."""
    if not args.json:
        print(text, flush=True)


@contextlib.contextmanager
def while_read() -> Iterator[None]:
    """Leave the block when the reader of the output is gone, and discard further output."""
    try:
        yield
    except BrokenPipeError:
        discard_output()
