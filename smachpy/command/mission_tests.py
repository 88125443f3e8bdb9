"""The part of `smachpy test` that tests mission files: they are checked and explored."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from smachpy.command.targets import MISSION_FILES
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--allow`."""
    parser.getgroup("smachpy").addoption(
        "--allow",
        action="append",
        default=[],
        metavar="PACKAGE",
        help="let a mission file name code of this package, as for smachpy run (repeatable)",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take the mission files that are named on the command line."""
    if file_path.suffix not in MISSION_FILES or not parent.session.isinitpath(file_path):
        return None
    return MissionFile.from_parent(parent, path=file_path)


class MissionFile(pytest.File):
    """A mission file. Its tests: no mistakes are found in it, and exploring it finds none."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the tests."""
        yield Checked.from_parent(self, name="check")
        yield Explored.from_parent(self, name="explore")


class _Item(pytest.Item):
    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException]) -> str:  # type: ignore[override]
        """Return what is wrong, without a traceback of ours."""
        if isinstance(excinfo.value, (AssertionError, SmachError)):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return where it is."""
        return self.path, None, self.name


class Checked(_Item):
    """It has no mistakes."""

    def runtest(self) -> None:
        """Load and check it."""
        from smachpy.checks import check
        from smachpy.files import load

        check(load(self.path, allow=self.config.getoption("allow"))).assert_ok()


class Explored(_Item):
    """Nothing that can happen breaks it."""

    def runtest(self) -> None:
        """Explore it."""
        from smachpy.command.explore import reckoning_states
        from smachpy.files import load
        from smachpy.testing.exploring.exploration import explore

        keep = reckoning_states(load(self.path, to_run=False))
        explore(lambda: load(self.path, to_run=False), keep=keep).assert_ok()
