"""JSON from files and from other programs: parsed to plain data, or refused with a reason.

Python's parser has no limits: `[[],[],...]` needs twenty times its length in memory, and programs
that walk through deeply nested data run out of stack. A text is counted before it is parsed.
"""

from __future__ import annotations

import json
import math
from typing import Any, Final

MAX_JSON_NESTING: Final = 100
"""Most levels of arrays and objects."""

MAX_JSON_PARTS: Final = 2_000_000
"""Most arrays and objects."""

_MAX_DIGITS: Final = 300

MAX_JSON_LENGTH: Final = 32_000_000
"""Longest text, unless the caller allows less [characters]."""


class JsonTextError(ValueError):
    """A text is not JSON, or is refused for its size."""


def load_json(
    text: str | bytes, *, longest: int = MAX_JSON_LENGTH, deepest: int = MAX_JSON_NESTING
) -> Any:
    """Return the data in a JSON text.

    NaN, Infinity and numbers that are too large for a float, which Python's parser accepts and
    browsers refuse when they are written again, become texts.

    Args:
        text: The text; bytes are UTF-8, malformed ones become U+FFFD.
        longest: Longest text [characters].
        deepest: Most levels of arrays and objects.

    Raises:
        JsonTextError: it is not JSON, is too long, is nested too deeply or has too many parts.
    """
    if len(text) > longest:
        raise JsonTextError(f"got {len(text):,} characters; expected at most {longest:,}")
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    parts = text.count("[") + text.count("{")
    if parts > MAX_JSON_PARTS:
        raise JsonTextError(
            f"got {parts:,} arrays and objects; expected at most {MAX_JSON_PARTS:,}"
        )
    try:
        data = _DECODER.decode(text)
    except RecursionError as error:
        raise JsonTextError(f"it is nested deeper than {deepest} levels") from error
    except ValueError as error:  # also for a number with thousands of digits
        raise JsonTextError(f"it is no JSON: {error}") from error
    if parts > deepest:
        check_depth(data, deepest)
    return data


def _finite(text: str) -> float | str:
    number = float(text)
    return number if math.isfinite(number) else text


def _whole(text: str) -> int | str:
    # A whole number that is too large for a float raises in any computation with floats.
    return text if len(text) > _MAX_DIGITS else int(text)


# `json.loads` makes one for each text, which takes as long as a short text.
_DECODER: Final = json.JSONDecoder(parse_constant=str, parse_float=_finite, parse_int=_whole)


def check_depth(data: Any, deepest: int = MAX_JSON_NESTING) -> None:
    """Check that data is not nested too deeply.

    Raises:
        JsonTextError: it has more than `deepest` levels of arrays and objects.
    """
    level = [data] if isinstance(data, (dict, list)) else []
    for _ in range(deepest):
        level = [
            item
            for one in level
            for item in (one.values() if isinstance(one, dict) else one)
            if isinstance(item, (dict, list))
        ]
        if not level:
            return
    raise JsonTextError(f"it is nested deeper than {deepest} levels")
