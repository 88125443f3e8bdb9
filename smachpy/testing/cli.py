"""`smachpy test`: runs pytest, with the mission fixtures and mission coverage."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import argparse
    from collections.abc import Sequence


def register(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "test",
        help="test missions with pytest",
        usage="%(prog)s [WORD ...]",
        epilog="All words are passed to pytest: smachpy test tests -k patrol --smachpy-coverage. A "
        "mission file (smachpy test patrol.yaml) is checked and explored. "
        "The options for missions are listed under 'robot missions' in pytest --help.",
    )
    parser.set_defaults(run=run, all_words=())


def run(args: argparse.Namespace) -> int:
    """Run pytest and return its exit code."""
    return run_pytest(args.all_words)


def run_pytest(arguments: Sequence[str]) -> int:
    """Run pytest in this process.

    Blocks: until the tests have ended.
    """
    import pytest

    # `smachpy` is already imported, so pytest cannot rewrite its asserts, and warns once per
    # module.
    quiet = "ignore:Module already imported:pytest.PytestAssertRewriteWarning"
    files = ["-p", "smachpy.command.mission_tests"]
    return int(pytest.main(["-W", quiet, *files, *arguments]))
