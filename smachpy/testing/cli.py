"""`smachpy test`: pytest, with the mission fixtures and mission coverage."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "test",
        help="test missions: pytest on PATH",
        epilog="What comes after PATH goes to pytest: smachpy test tests -k patrol -n 2",
    )
    parser.add_argument("path", nargs="?", default=".", help="file or folder; default: here")
    parser.add_argument(
        "options",
        nargs=argparse.REMAINDER,
        help="options of pytest, such as --mission-coverage",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run pytest and return its exit code."""
    return run_pytest([args.path, *args.options])


def run_pytest(arguments: Sequence[str]) -> int:
    """Run pytest in this process.

    Blocks: until the tests have ended.
    """
    import pytest

    return int(pytest.main(list(arguments)))
