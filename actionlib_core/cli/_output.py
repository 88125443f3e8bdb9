"""How commands print messages: YAML for people, one JSON object per line for programs."""

from __future__ import annotations

import json
import textwrap
from typing import Any


def print_json(**fields: Any) -> None:
    """Print one JSON object on a line, at once."""
    print(json.dumps(fields), flush=True)


def print_message(title: str, message: Any) -> None:
    """Print a message as YAML, indented under a title, and an empty line."""
    print(f"{title}\n{textwrap.indent(message.to_yaml().rstrip() or '{}', '    ')}\n", flush=True)


def add_json(parser: Any) -> None:
    """Add the flag that every command has."""
    parser.add_argument("--json", action="store_true", help="print JSON")
