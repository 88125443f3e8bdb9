"""How commands print messages: YAML for people, one JSON object per line for programs."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import textwrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator


def print_json(**fields: Any) -> None:
    """Print one JSON object on a line, at once."""
    print(json.dumps(fields), flush=True)


def print_message(title: str, message: Any) -> None:
    """Print a message as YAML, indented under a title, and an empty line."""
    print(f"{title}\n{textwrap.indent(message.to_yaml().rstrip() or '{}', '    ')}\n", flush=True)


def add_json(parser: Any) -> None:
    """Add the flag that every command has."""
    parser.add_argument("--json", action="store_true", help="print JSON")


def discard_output() -> None:
    """Print to nowhere from now on: the reader of the output has gone (`... | head`).

    What is still in the buffers is dropped, so that the interpreter does not fail at it in the end.
    """
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)


@contextlib.contextmanager
def while_read() -> Iterator[None]:
    """Leave the block when the reader of the output has gone, and discard what is printed then."""
    try:
        yield
    except BrokenPipeError:
        discard_output()
