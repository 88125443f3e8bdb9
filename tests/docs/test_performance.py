"""The page of performance gives the budgets that `make bench-check` holds."""

from __future__ import annotations

import re
import tomllib

import pytest

from tests.places import DOCS, ROOT

ROW = re.compile(r"^\|.*\(`([^`]+)`\).*\| at (most|least) ([\d.]+) \|$", re.MULTILINE)


def rows():
    return ROW.findall((DOCS / "performance.md").read_text("utf-8"))


def test_the_page_has_rows_with_budgets():
    assert len(rows()) > 15


@pytest.mark.parametrize(("name", "side", "value"), rows())
def test_a_budget_on_the_page_is_the_one_that_is_held(name, side, value):
    parts = tomllib.loads((ROOT / "benchmarks" / "budgets.toml").read_text("utf-8"))
    (budget,) = [part[name] for part in parts.values() if name in part]
    assert budget[f"at_{side}"] == float(value)
