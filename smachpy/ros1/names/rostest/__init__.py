"""rostest and rosunit: run a test case, as `unittest` does."""

from __future__ import annotations

import sys
import unittest
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["rosrun", "run", "unitrun"]


def rosrun(
    package: str, test_name: str, test: Any, sysargs: Sequence[str] | None = None, *_: Any
) -> None:
    """Run a test case and end the program: with 0 if all of it passed, else with 1.

    Args:
        package: As rostest takes it.
        test_name: As rostest takes it.
        test: A `unittest.TestCase`, or its name.
        sysargs: As rostest takes it.

    Raises:
        SystemExit: always.
    """
    del package, test_name, sysargs
    loader = unittest.TestLoader()
    named = isinstance(test, str)
    suite = loader.loadTestsFromName(test) if named else loader.loadTestsFromTestCase(test)
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    sys.exit(0 if result.wasSuccessful() else 1)


run = unitrun = rosrun
