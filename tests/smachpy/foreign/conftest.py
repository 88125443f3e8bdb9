"""For the tests of files of other tools."""

from __future__ import annotations

import sys

import pytest


@pytest.fixture(autouse=True)
def _own_states(monkeypatch):
    """Forget the module of the states of another test's folder."""
    monkeypatch.delitem(sys.modules, "smachpy_states", raising=False)
    yield
    sys.modules.pop("smachpy_states", None)
