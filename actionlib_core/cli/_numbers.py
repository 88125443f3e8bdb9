"""Numbers on the command line: what is no use is refused with the range that is."""

from __future__ import annotations

import argparse
import math


def seconds(text: str) -> float:
    """Read a length of time [s], above 0."""
    return _positive(text, "seconds above 0")


def rate(text: str) -> float:
    """Read a rate [Hz], above 0."""
    return _positive(text, "a rate above 0 [Hz]")


def count(text: str) -> int:
    """Read how many, 1 at least."""
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected a whole number above 0")
    return number


def size(text: str) -> int:
    """Read how many, 0 at least."""
    return 0 if text == "0" else count(text)


def _positive(text: str, wanted: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0):
        raise argparse.ArgumentTypeError(f"got {text!r}; expected {wanted}")
    return number
