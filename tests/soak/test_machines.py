"""A short campaign of random machines; `make soak` runs a long one."""

from __future__ import annotations

import pytest

from tests.soak import machines


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 20001])
def test_random_machines_keep_what_is_promised(seed, capsys):
    figures = machines.main(20.0, seed, most=80)
    assert figures.problems == [], capsys.readouterr().out
    assert figures.machines.total() > 0
