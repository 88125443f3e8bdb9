"""Runs at the workers of a Dask scheduler: the same results, with workers that die and others."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from smachpy.base.cluster import Cluster, ClusterError
from smachpy.command import main

LONG_S = 100.0
MISSION = """
from smachpy import CBState, Concurrence, StateMachine

OUTCOMES = ["good", "bad", "preempted"]


def work(_userdata):
    return "good"


def mission(word: str = "x"):
    beside = Concurrence(OUTCOMES, default_outcome="bad", outcome_map={"good": {"A": "good"}})
    with beside:
        for name in "ABC":
            beside.add(name, CBState(work, outcomes=OUTCOMES))
    sm = StateMachine(OUTCOMES, name="WIDE")
    with sm:
        sm.add("BESIDE", beside, {"good": "LAST", "bad": "LAST"})
        sm.add("LAST", CBState(work, outcomes=OUTCOMES))
    return sm
"""


class Dask:
    """A scheduler, and workers, in processes of their own."""

    def __init__(self, stack, folder):
        self._stack, self._folder = stack, folder
        _, self.address = self._start("scheduler", r"Scheduler at:\s+(tcp:\S+)")

    def worker(self, **environment):
        options = [self.address, "--no-nanny", "--nthreads", "1"]
        return self._start("worker", r"Registered to:\s+(tcp:\S+)", *options, **environment)[0]

    def _start(self, what, ready, *words, **environment):
        options = ["--host", "127.0.0.1", "--port" if what == "scheduler" else "--worker-port", "0"]
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *options, "--no-dashboard"]
        process = subprocess.Popen(
            [*command, *words],
            cwd=self._folder,
            env={**os.environ, **environment},
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            text=True,
        )
        self._stack.callback(process.stderr.close)
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        for line in process.stderr:
            if found := re.search(ready, line):
                return process, found[1]
        raise AssertionError(f"{what} has ended")


@pytest.fixture
def dask(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("wide.py").write_text(MISSION)
    with contextlib.ExitStack() as stack:
        (tmp_path / "there").mkdir()
        yield Dask(stack, tmp_path / "there")


def smachpy(*words, code=0):
    """Run the command in a process; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-m", "smachpy", *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == code, done.stderr
    return done


def steady(text):
    """Leave out how long it took."""
    return re.sub(r"\d+(\.\d+)? m?s\b", "", text)


def test_an_address_of_another_form_is_refused():
    for text in ("8786", "http://x:1", "tcp://x"):
        with pytest.raises(ClusterError, match=r"--on: got .*; expected tcp://HOST:PORT"):
            Cluster(text, dict, (), print)


def test_the_extra_is_named_where_it_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("wide.py").write_text(MISSION)
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["explore", "wide.py", "--on", "tcp://127.0.0.1:9"]) == 2
    assert "pip install 'smachpy[dask]'" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_workers_find_what_this_computer_finds_and_others_are_refused(dask, tmp_path):
    for _ in range(2):
        dask.worker()
    other = tmp_path / "other"
    other.mkdir()
    (other / "sitecustomize.py").write_text(
        "import platform\nplatform.python_version = lambda: '3.1.4'\n"
    )
    dask.worker(PYTHONPATH=str(other))
    at = ["--on", dask.address]
    words = ["explore", "wide.py", "--max-runs", "60", "--max-time", "3600", "--fault", "raise"]
    here, there = smachpy(*words, code=1), smachpy(*words, *at, code=1)
    assert steady(there.stdout) == steady(here.stdout)
    (refused,) = there.stderr.splitlines()
    assert re.match(r"worker tcp://127.0.0.1:\d+: not used: got Python 3.1.4; expected ", refused)
    words = ["simulate", "wide.py", "--runs", "5", "--json"]
    assert smachpy(*words, *at, "--record", "runs").stdout == smachpy(*words).stdout
    assert len(list(Path("runs").glob("*.jsonl"))) == 5
    words = ["runs", "reproduce", "runs", "--mission", "wide.py", "--allow", "wide.py"]
    assert steady(smachpy(*words, *at).stdout) == steady(smachpy(*words).stdout)
    words = ["certify", "wide.py", "--runs", "2", "--max-runs", "20", "--recordings", "runs"]
    smachpy(*words, *at, "-o", "e.json", code=1)
    found = json.loads(Path("e.json").read_text())
    assert found["explore"]["runs"] == 20
    assert found["simulate"]["outcomes"] == {"good": 2}
    assert [one["result"] for one in found["reproduce"]["recordings"]] == ["same"] * 5


def kill_the_worker_at_first(pid, mark):
    """A task whose worker dies when it is done the first time."""
    with contextlib.suppress(FileExistsError), Path(mark).open("x"):
        os.kill(pid, signal.SIGKILL)
    return os.getpid()


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.filterwarnings("ignore")
def test_a_worker_that_dies_costs_its_tasks_again_and_the_last_one_all(dask, tmp_path, monkeypatch):
    folder = str(Path(__file__).parent)
    one, two = (dask.worker(PYTHONPATH=folder) for _ in range(2))
    monkeypatch.syspath_prepend(folder)
    task = __import__("test_on").kill_the_worker_at_first
    with Cluster(dask.address, dict, (), print) as cluster:
        assert (cluster.workers, cluster.count) == (2, 2)
        futures = [cluster.submit(task, one.pid, tmp_path / "first")]
        futures += [cluster.submit(os.getpid) for _ in range(8)]
        assert one.wait(LONG_S) == -signal.SIGKILL
        pids = {future.result(LONG_S) for future in futures}
        assert not pids & {one.pid, two.pid, os.getpid()}  # in processes beside the workers
        lost = cluster.submit(task, two.pid, tmp_path / "second")
        with pytest.raises(ClusterError, match="no worker is left"):
            lost.result(LONG_S)
        with pytest.raises(ClusterError, match="no worker is left"):
            cluster.submit(os.getpid).result(LONG_S)


def wait_for_ever(fifo):
    """A task that tells its process, and never ends."""
    with Path(fifo).open("w") as pipe:
        pipe.write(str(os.getpid()))
    signal.pause()


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.filterwarnings("ignore")
def test_the_end_of_the_program_ends_its_processes_at_the_workers(dask, tmp_path, monkeypatch):
    folder = str(Path(__file__).parent)
    dask.worker(PYTHONPATH=folder)
    monkeypatch.syspath_prepend(folder)
    os.mkfifo(tmp_path / "fifo")
    with contextlib.suppress(KeyboardInterrupt):
        with Cluster(dask.address, dict, (), print) as cluster:
            cluster.submit(__import__("test_on").wait_for_ever, tmp_path / "fifo")
            pid = int((tmp_path / "fifo").read_text())
            handle = os.pidfd_open(pid)
            raise KeyboardInterrupt
    with open(handle, "rb", buffering=0) as ended:
        assert select.select([ended], [], [], LONG_S)[0]
