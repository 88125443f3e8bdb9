"""Numbers of the command line, as types of argparse: each raises an ArgumentTypeError otherwise."""

from __future__ import annotations

import argparse
import math
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

_WHOLE = re.compile(r"-?[0-9]{1,18}")


def finite(text: str) -> float:
    """Read a finite number."""
    return _real(text, "a finite number")


def seconds(text: str) -> float:
    """Read a length of time [s], above 0."""
    return _real(text, "seconds above 0", above=0.0)


def rate(text: str) -> float:
    """Read a rate [Hz], above 0."""
    return _real(text, "a rate above 0 [Hz]", above=0.0)


def count(text: str) -> int:
    """Read a number of items, at least 1."""
    return between(1, wanted="a whole number above 0")(text)


def size(text: str) -> int:
    """Read a number of items, at least 0."""
    return between(0)(text)


def between(least: int, most: float = math.inf, wanted: str = "") -> Callable[[str], int]:
    """Return the type of whole numbers from `least` to `most`; `wanted` is for the error."""
    wanted = wanted or (f"{least} or more" if most == math.inf else f"{least} to {most}")

    def whole(text: str) -> int:
        if not _WHOLE.fullmatch(text) or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"got {text!r}; expected {wanted}")
        return int(text)

    return whole


def _real(text: str, wanted: str, above: float = -math.inf) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > above):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected {wanted}")
    return number
