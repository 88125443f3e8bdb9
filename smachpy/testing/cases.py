"""Testing missions with unittest."""

from __future__ import annotations

import unittest
from typing import TYPE_CHECKING

from smachpy import log
from smachpy.testing import session
from smachpy.testing.kit import MissionKit

if TYPE_CHECKING:
    from typing import ClassVar


class MissionTestCase(unittest.TestCase):
    """A test case with `self.mission`, a `MissionKit` for each test.

    Under pytest its options hold: coverage, rate and seeds. With `--mission-seeds` each test runs
    with one after the other, up to the first that fails.

    Attributes:
        seed: Picks the interleaving of all tests of the class; None: as the session says.
        mission: Runs machines; has `action_server`, `service_server`, `topic`, `replace`,
            `preempt`, `interrupt` and `explore`.
    """

    seed: ClassVar[int | None] = None
    mission: MissionKit
    _seed: int | None = None
    _passed = False

    def run(self, result: unittest.TestResult | None = None) -> unittest.TestResult | None:
        """Run the test, with each seed."""
        seeds = session.current().seeds if self.seed is None else (self.seed,)
        for seed in seeds:
            self._seed, self._passed = seed, False
            result = super().run(result)
            if not self._passed:
                if len(seeds) > 1:
                    log.logwarn(f"{self.id()}: mission seed {seed}")
                break
        return result

    def doCleanups(self) -> bool:  # type: ignore[override]  # noqa: N802  unittest's name
        """Close the kit; return whether the test passed."""
        self._passed = bool(super().doCleanups())
        return self._passed

    def setUp(self) -> None:
        """Open the kit."""
        super().setUp()
        around = session.current()
        self.mission = MissionKit(seed=self._seed, rate=around.rate, on_run=around.on_run)
        self.mission.__enter__()
        self.addCleanup(self.mission.__exit__, None, None, None)
