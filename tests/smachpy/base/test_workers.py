"""Processes for simulated runs: one that dies takes only its task with it."""

from __future__ import annotations

import os
import sys
import threading
import time
from concurrent.futures import CancelledError

import pytest

from smachpy.base.workers import WorkerError, Workers

pytestmark = pytest.mark.slow


@pytest.fixture
def workers():
    made = Workers(2)
    yield made
    made.kill()
    made.shutdown(cancel_futures=True)


def test_a_process_that_dies_takes_only_its_task_with_it(workers):
    """With a pool of `concurrent.futures` all tasks were lost, and the culprit was not named."""
    ends = [workers.submit(os._exit, 3), workers.submit(os.abort)]
    results = [workers.submit(abs, -number) for number in range(6)]
    assert [one.result(60) for one in results] == [0, 1, 2, 3, 4, 5]
    assert [str(one.exception(60)) for one in ends] == [
        "its process died 3 times: exit code 3",
        "its process died 3 times: signal SIGABRT",
    ]


DIE_ONCE = """
import os, pathlib, signal
if not pathlib.Path(path).exists():
    pathlib.Path(path).touch()
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_process_that_is_killed_costs_its_task_another_try(workers, tmp_path):
    futures = [
        workers.submit(exec, DIE_ONCE, {"path": str(tmp_path / str(number))}) for number in range(4)
    ]
    assert [one.result(60) for one in futures] == [None] * 4
    assert len(list(tmp_path.iterdir())) == 4


def test_a_result_that_cannot_be_sent_is_an_error_of_its_task(workers):
    assert "pickle" in str(workers.submit(threading.Lock).exception(60))
    assert workers.submit(abs, -7).result(60) == 7


def test_an_exception_and_sys_exit_are_the_end_of_the_task_only(workers):
    failures = [workers.submit(divmod, 1, 0), workers.submit(sys.exit, "enough")]
    assert workers.submit(abs, -7).result(60) == 7
    texts = [str(one.exception(60)) for one in failures]
    assert texts[0].startswith("ZeroDivisionError: ")
    assert texts[1] == "SystemExit: enough"


def test_what_cannot_be_sent_is_an_error_of_its_task(workers):
    assert "pickle" in str(workers.submit(abs, threading.Lock()).exception(60))
    assert workers.submit(abs, -7).result(60) == 7


def test_processes_have_the_python_path_and_nothing_of_the_current_folder(
    workers, tmp_path, monkeypatch
):
    """A file signal.py beside the mission took the place of Python's."""
    (tmp_path / "here").mkdir()
    (tmp_path / "there").mkdir()
    for name in ("signal", "argparse", "own_of_here"):
        (tmp_path / "here" / f"{name}.py").write_text("raise SystemExit(9)")
    (tmp_path / "there" / "own_of_there.py").write_text("WORD = 'x'")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.syspath_prepend(tmp_path / "there")
    assert workers.submit(eval, "__import__('own_of_there').WORD").result(60) == "x"
    gone = workers.submit(__import__, "own_of_here").exception(60)
    assert "No module named 'own_of_here'" in str(gone)


def test_ctrl_c_in_the_terminal_does_not_reach_the_processes(workers):
    assert workers.submit(os.getsid, 0).result(60) != os.getsid(0)


def test_kill_ends_tasks_that_never_end_and_cancels_those_that_wait(workers):
    asleep = [workers.submit(time.sleep, 3600) for _ in range(3)]
    while sum(one.running() for one in asleep) < 2:
        threading.Event().wait(0.01)
    workers.shutdown(wait=False, cancel_futures=True)
    workers.kill()
    ends = {type(one.exception(60)) if not one.cancelled() else CancelledError for one in asleep}
    assert ends == {WorkerError, CancelledError}
