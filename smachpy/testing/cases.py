"""Tests missions with unittest."""

from __future__ import annotations

import sys
import unittest
from typing import TYPE_CHECKING, Any, cast

from smachpy.base import log
from smachpy.testing import session
from smachpy.testing.kit import MissionKit

if TYPE_CHECKING:
    from typing import ClassVar


class MissionTestCase(unittest.TestCase):
    """A test case with `self.mission`, a `MissionKit` for each test.

    Under pytest, its options apply: coverage, rate and seeds. With `--mission-seeds` each test runs
    with one seed after another, until one fails; it is skipped if it skips with every seed.

    Attributes:
        seed: Seed for all tests of the class; None: as in the session.
        mission: Runs machines; has `action_server`, `service_server`, `topic`, `replace`,
            `preempt`, `interrupt` and `explore`.
    """

    seed: ClassVar[int | None] = None
    mission: MissionKit
    _seed: int | None = None

    def run(self, result: unittest.TestResult | None = None) -> unittest.TestResult | None:
        """Run the test, with each seed."""
        seeds = session.current().seeds if self.seed is None else (self.seed,)
        self._seed = seeds[0]
        if len(seeds) == 1:
            return super().run(result)
        if result is None:
            result = self.defaultTestResult()
        skips = 0
        runner = getattr(self, "_asyncioRunner", None)
        for number, seed in enumerate(seeds, 1):
            self._seed = seed
            # `IsolatedAsyncioTestCase.run` makes one, and fails if there is one of an earlier run.
            self._asyncioRunner = runner
            part = _SeedResult(result, is_last=number == len(seeds), all_skip=skips == number - 1)
            super().run(cast("unittest.TestResult", part))
            skips += part.skipped
            if part.failed:
                log.logwarn(f"{self.id()}: mission seed {seed}")
                break
        return result

    def setUp(self) -> None:
        """Open the kit."""
        super().setUp()
        around = session.current()
        self.mission = MissionKit(seed=self._seed, rate=around.rate, on_run=around.on_run)
        self.mission.__enter__()
        self.addCleanup(self.mission.__exit__, None, None, None)


class _SeedResult:
    """Collects a test's result with one of its seeds, and passes on what counts for the test.

    Only the last seed may report something else than a failure: pytest takes the first report for
    the whole test, and a skip would hide a failure with a later seed.

    Args:
        result: The result of the test.
        is_last: Whether this is the last seed.
        all_skip: Whether the test skipped with all previous seeds.

    Attributes:
        failed: Whether the test failed.
        skipped: Whether it, or a subtest, skipped.
    """

    def __init__(self, result: unittest.TestResult, *, is_last: bool, all_skip: bool) -> None:
        self._result = result
        self._is_last = is_last
        self._all_skip = all_skip
        self.failed = False
        self.skipped = False

    def __getattr__(self, name: str) -> Any:
        own = getattr(self._result, name)
        return self._add_part if name == "addSubTest" else own  # not every result has it

    def addSkip(self, test: Any, reason: str) -> None:  # noqa: N802  unittest's names
        self.skipped = True
        if self._is_last and self._all_skip:
            self._result.addSkip(test, reason)

    def addExpectedFailure(self, test: Any, error: Any) -> None:  # noqa: N802
        if self._is_last:
            self._result.addExpectedFailure(test, error)

    def addUnexpectedSuccess(self, test: Any) -> None:  # noqa: N802
        self.failed = True
        self._result.addUnexpectedSuccess(test)

    def addFailure(self, test: Any, error: Any) -> None:  # noqa: N802
        self.failed = True
        self._result.addFailure(test, error)

    def addError(self, test: Any, error: Any) -> None:  # noqa: N802
        if not _is_skip(error[0]):
            self.failed = True
        elif not (self._is_last and self._all_skip):
            self.skipped = True
            return
        self._result.addError(test, error)

    def _add_part(self, test: Any, part: Any, error: Any) -> None:
        self.failed = self.failed or error is not None
        self._result.addSubTest(test, part, error)


def _is_skip(kind: type[BaseException]) -> bool:
    """Return whether this is pytest's own skip, which unittest reports as an error."""
    pytest = sys.modules.get("pytest")
    return pytest is not None and issubclass(kind, pytest.skip.Exception)
