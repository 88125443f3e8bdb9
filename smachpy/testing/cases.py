"""Testing missions with unittest."""

from __future__ import annotations

import unittest
from typing import TYPE_CHECKING

from smachpy.testing.kit import MissionKit

if TYPE_CHECKING:
    from typing import ClassVar


class MissionTestCase(unittest.TestCase):
    """A test case with `self.mission`, a `MissionKit` for each test.

    Attributes:
        seed: Picks the interleaving of all tests of the class.
        mission: Runs machines; has `action_server`, `service_server`, `topic`, `replace`,
            `preempt`, `interrupt` and `explore`.
    """

    seed: ClassVar[int | None] = None
    mission: MissionKit

    def setUp(self) -> None:
        """Open the kit."""
        super().setUp()
        self.mission = MissionKit(seed=self.seed)
        self.mission.__enter__()
        self.addCleanup(self.mission.__exit__, None, None, None)
