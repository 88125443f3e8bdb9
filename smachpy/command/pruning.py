"""Options of lists and of `prune`, the same for missions and for recordings."""

from __future__ import annotations

import argparse
import re
from typing import Final

from actionlib_core.command_line.numbers import size
from smachpy.events.outcome_classes import is_good

_UNITS: Final = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 7 * 86400}
KEEPABLE: Final = ("failed", "none")
_KIB: Final = 1024


def add_page(parser: argparse.ArgumentParser, what: str) -> None:
    """Add `--limit` and `--skip` for a list of `what`, whose newest come first."""
    parser.add_argument(
        "--limit",
        type=size,
        default=50,
        metavar="N",
        help=f"the most {what} that are listed, the newest first (default: %(default)s)",
    )
    parser.add_argument(
        "--skip", type=size, default=0, metavar="N", help="omit this many of the newest"
    )


def add_age(parser: argparse.ArgumentParser, what: str) -> None:
    """Add `--older-than` and `--keep` for the command that deletes `what`."""
    parser.add_argument(
        "--older-than",
        type=age,
        required=True,
        metavar="AGE",
        help=f"only {what} that have been over for so long: 30d, 12h, 90m, 2w",
    )
    add_keep(parser, what)


def add_keep(parser: argparse.ArgumentParser, what: str) -> None:
    """Add `--keep`."""
    parser.add_argument(
        "--keep",
        choices=KEEPABLE,
        default="none",
        help=f"{what} that are not deleted: 'failed', also preempted ones (default: %(default)s)",
    )


def age(text: str) -> float:
    """Read an age of the command line [s].

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    found = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)([smhdw])", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"got {text!r}; expected an age such as 30d, 12h or 90m")
    return float(found[1]) * _UNITS[found[2]]


def deleted(count: int) -> str:
    """Return how many missions were deleted, for people."""
    return f"{count} {'mission' if count == 1 else 'missions'} deleted"


def is_kept(
    keep: str, outcome: str | None, status: str = "", success: tuple[str, ...] | None = None
) -> bool:
    """Return whether `--keep` keeps what has ended with this outcome.

    Args:
        keep: The option.
        outcome: None: without any.
        status: Of a mission; "cancelled" is no failure.
        success: The outcomes that are good; None goes by their names.
    """
    if keep != "failed" or status == "cancelled":
        return False
    return outcome is None or not is_good(outcome, success)


def size_text(size: int) -> str:
    """Return a size [bytes] for people: "3.2 MiB"."""
    number, units = float(size), ["B", "KiB", "MiB", "GiB"]
    while number >= _KIB and len(units) > 1:
        number /= _KIB
        del units[0]
    return f"{number:.0f} B" if units[0] == "B" else f"{number:.1f} {units[0]}"
