"""The part of `smachpy test` that tests mission files: they are checked and explored."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from smachpy.command.targets import MISSION_FILES, OTHER_TOOLS
from smachpy.exceptions import SmachError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from smachpy.machines.container import Container


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--allow` and `--input`."""
    from smachpy.command.run import read_input

    group = parser.getgroup("smachpy")
    group.addoption(
        "--allow",
        action="append",
        default=[],
        metavar="PACKAGE",
        help="let a mission file name code of this package, as for smachpy run (repeatable)",
    )
    group.addoption(
        "--input",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        type=read_input,
        help="a parameter of a mission file, as for smachpy run (repeatable)",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take the mission files that are named on the command line."""
    is_mission = file_path.suffix in {*MISSION_FILES, *OTHER_TOOLS}
    if not is_mission or not parent.session.isinitpath(file_path):
        return None
    return MissionFile.from_parent(parent, path=file_path)


class MissionFile(pytest.File):
    """A mission file. Its tests: no mistakes are found in it, and exploring it finds none."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the tests."""
        yield Checked.from_parent(self, name="check")
        yield Explored.from_parent(self, name="explore")


class _Item(pytest.Item):
    def build(self, *, to_run: bool = True) -> Container:
        """Return the machine; False to look at it only, so that no package need be allowed."""
        from smachpy.command.mission_run import build
        from smachpy.command.run import read_inputs
        from smachpy.command.targets import load_target

        allow = self.config.getoption("allow") if to_run else None
        target = load_target(str(self.path), imports=False, allow=allow)
        inputs = read_inputs(self.config.getoption("input"))
        return build(target, inputs, to_run=False) if inputs else target.build()

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

        check(self.build()).assert_ok()


class Explored(_Item):
    """Nothing that can happen breaks it."""

    def runtest(self) -> None:
        """Explore it."""
        from smachpy.command.explore import reckoning_states
        from smachpy.testing.exploring.exploration import explore

        keep = reckoning_states(self.build(to_run=False))
        explore(lambda: self.build(to_run=False), keep=keep).assert_ok()
