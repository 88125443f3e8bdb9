"""A short campaign; `make soak` runs a long one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.zenoh
@pytest.mark.slow
@pytest.mark.timeout(900)
def test_short_campaign_breaks_no_promise():
    campaign = Path(__file__).with_name("soak.py")
    ended = subprocess.run(
        [sys.executable, campaign, "--goals", "4000", "--seconds", "1"],
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    print(ended.stdout)
    assert "goals sent" in ended.stdout
    assert ended.returncode == 0, ended.stdout
