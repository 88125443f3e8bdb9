"""The public API is pinned: a name that vanishes or changes is noticed here, not by users."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.places import ROOT


@pytest.mark.slow
def test_the_public_api_is_the_one_that_is_pinned():
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "api", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, (
        f"{done.stdout}{done.stderr}If that is meant: python .ci/api, and a line in CHANGELOG.md."
    )
