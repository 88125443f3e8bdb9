"""rostest and rosunit: run a test case with `unittest`."""

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
        package: Ignored.
        test_name: Ignored.
        test: A `unittest.TestCase`, or its name.
        sysargs: Ignored.

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
