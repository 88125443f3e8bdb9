"""Explorations on several cores find what one finds."""

from __future__ import annotations

import importlib
import os
from concurrent.futures import Future
from pathlib import Path

import pytest

from smachpy.base import workers
from smachpy.base.workers import WorkerProcess, Workers
from smachpy.testing import explore
from smachpy.testing.exploring import exploration
from smachpy.testing.exploring.ahead import Ahead

pytestmark = pytest.mark.slow


has_begun = Ahead._has_begun


def waits_for_a_process(self):
    """As `_has_begun`, but this process does no runs meanwhile: the others do some in any case."""
    while self._job and not has_begun(self):
        self._take_answer()
    return True


@pytest.fixture(autouse=True)
def _at_once(monkeypatch):
    monkeypatch.setattr(exploration, "AHEAD_AFTER_S", -1.0)
    monkeypatch.setattr(Ahead, "_has_begun", waits_for_a_process)


@pytest.fixture
def mine(monkeypatch):
    """The machine and its invariants, in a module that every process finds."""
    monkeypatch.syspath_prepend(Path(__file__).parent)
    module = importlib.import_module("explored")
    monkeypatch.setenv(module.HERE, str(os.getpid()))
    return module


def nowhere():
    """Of a module that other processes do not find."""
    return importlib.import_module("explored").wide()


def facts(found):
    example = found.counterexample
    what = None if example is None else (example.reason, example.choices, example.script)
    return found.ok, found.runs, found.exhaustive, found.stopped_by, what


@pytest.mark.parametrize(
    ("invariants", "max_runs"),
    [([], 150), (["keeps"], 70), (["last_is_good_after_bad_ones"], 400)],
)
def test_what_is_found_does_not_depend_on_the_number_of_processes(mine, invariants, max_runs):
    seen = []
    for jobs in (1, 2, 5):
        paths = []
        found = explore(
            mine.wide,
            invariants=[getattr(mine, name) for name in invariants],
            max_runs=max_runs,
            max_time=3600.0,
            jobs=jobs,
            on_run=lambda run, paths=paths: paths.append((run.outcome, run.path)),
        )
        seen.append((facts(found), paths))
    assert seen[0] == seen[1] == seen[2]
    assert seen[0][0][1] > 3


class Others(Workers):
    """Processes as a cluster has them: not begun, and not ended, by the exploration."""

    count = 3


def test_the_processes_of_a_cluster_find_the_same(mine):
    alone = explore(mine.wide, max_runs=60, max_time=3600.0, jobs=1)
    counts = []
    with Others(Others.count) as cluster:
        found = explore(
            mine.wide, max_runs=60, max_time=3600.0, cluster=cluster, progress=counts.append
        )
        assert cluster.submit(os.getpid).result() != os.getpid()
    assert facts(found) == facts(alone)
    assert counts == list(range(60))


def test_this_process_goes_on_while_the_others_begin(mine, monkeypatch):
    monkeypatch.setattr(Ahead, "_has_begun", has_begun)

    class Slow(Workers):
        """Processes that take as long to begin as the exploration."""

        count = 3
        asked = 0

        def submit(self, *_args):
            self.asked += 1
            return Future()

    alone = explore(mine.wide, max_runs=60, max_time=3600.0, jobs=1)
    with Slow(0) as cluster:
        found = explore(mine.wide, max_runs=60, max_time=3600.0, cluster=cluster)
    assert facts(found) == facts(alone)
    assert cluster.asked == Slow.count


def test_a_process_that_is_killed_costs_its_runs_again(mine, monkeypatch, tmp_path):
    alone = explore(
        mine.wide, invariants=[mine.is_killed_once], max_runs=60, max_time=3600.0, jobs=1
    )
    monkeypatch.setenv(mine.MARK, str(tmp_path / "killed"))
    found = explore(
        mine.wide, invariants=[mine.is_killed_once], max_runs=60, max_time=3600.0, jobs=2
    )
    assert (tmp_path / "killed").exists()
    assert facts(found) == facts(alone)


def test_runs_that_kill_each_process_are_done_here(mine):
    found = explore(mine.wide, invariants=[mine.kills_others], max_runs=30, max_time=3600.0, jobs=2)
    assert found.ok
    assert found.runs == 30


def test_nothing_is_left_after_ctrl_c(mine, monkeypatch):
    """Neither processes nor their pipes."""
    made = []

    class Noted(WorkerProcess):
        def __init__(self):
            super().__init__()
            made.append(self)

    monkeypatch.setattr(workers, "WorkerProcess", Noted)
    count = 0

    def interrupt(_run):
        nonlocal count
        count += 1
        if count == 20:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        explore(mine.wide, on_run=interrupt, max_time=3600.0, jobs=2)
    assert made
    assert all(one.connection.closed and one._process.returncode is not None for one in made)


@pytest.mark.parametrize("made_by", ["itself", "a lambda", "a module that is nowhere"])
def test_what_cannot_be_sent_is_explored_here(mine, made_by):
    given = {"itself": mine.wide(), "a lambda": lambda: mine.wide()}.get(made_by, nowhere)
    assert facts(explore(given, max_runs=40, max_time=3600.0, jobs=2)) == facts(
        explore(mine.wide, max_runs=40, max_time=3600.0, jobs=1)
    )


def test_a_machine_that_is_another_one_in_each_process_is_explored_here(mine):
    """As one that iterates over a set of texts, whose order each process chooses."""
    alone, shared = (
        explore(mine.other_there, invariants=[mine.keeps], max_runs=30, max_time=3600.0, jobs=jobs)
        for jobs in (1, 2)
    )
    assert facts(shared) == facts(alone)
    assert alone.runs == 30


def test_a_number_of_processes_that_is_none(mine):
    with pytest.raises(ValueError, match="jobs: got 0; expected 1 or more"):
        explore(mine.wide, jobs=0)
