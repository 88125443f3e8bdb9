"""Which figures of the benchmarks fail a build."""

from __future__ import annotations

import importlib.util
import sys

import pytest

from tests.places import ROOT


@pytest.fixture
def bench(monkeypatch):
    spec = importlib.util.spec_from_file_location("bench", ROOT / "benchmarks" / "bench.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "bench", module)  # its dataclasses look for their module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("budget", "value", "fails"),
    [
        ({"at_most": 7}, 7.0, False),
        ({"at_most": 7}, 7.1, True),
        ({"at_least": 5}, 4.9, True),
        ({"at_most": 0.5, "timed": True}, 0.9, False),
        ({"at_most": 0.5, "timed": True}, 1.1, True),
        ({"at_least": 5, "timed": True}, 3.0, False),
        ({"at_least": 5, "timed": True}, 2.0, True),
        ({"at_most": 1, "machine": True}, 50.0, False),
        ({}, 50.0, False),
    ],
)
def test_a_count_fails_at_its_budget_and_a_ratio_of_times_at_twice_that(
    bench, budget, value, fails
):
    assert bench.Figure("actions", "p50", budget, [value]).fails() is fails


def checked(bench, monkeypatch, *rounds):
    """Check counts that are found by turns; return the exit code and how often was measured."""
    runs = iter(rounds)
    monkeypatch.setattr(bench, "run", lambda *_, **__: {"bytes per state": next(runs)})
    monkeypatch.setattr(bench, "noise", lambda: [1.0])
    code = bench.check([bench.Benchmark("counts")])
    return code, len(rounds) - len(list(runs))


def test_a_figure_that_holds_once_in_three_measurements_passes(bench, monkeypatch):
    assert checked(bench, monkeypatch, 5000, 5000, 700) == (0, 3)
    assert checked(bench, monkeypatch, 700) == (0, 1)


def test_a_figure_that_never_holds_fails_and_is_named(bench, monkeypatch, capsys):
    assert checked(bench, monkeypatch, 5000, 5000, 6000) == (1, 3)
    assert "counts: bytes per state: got 6000" in capsys.readouterr().out
