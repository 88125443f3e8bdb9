"""Programs that never outlive their parent; real processes."""

from __future__ import annotations

import sys
import threading

import pytest

from actionlib_core.shutdown.child_process import ChildProcess

CHILD = """
import sys
print("ready at", *sys.argv[1:], flush=True)
print("a note", file=sys.stderr, flush=True)
sys.stdin.read()
sys.exit(3 if "--bad" in sys.argv else 0)
"""


@pytest.fixture
def child(tmp_path):
    (tmp_path / "a_child.py").write_text(CHILD)
    (tmp_path / "no_child.py").write_text("import sys; sys.exit('not today')")
    started = []

    def child(module, *arguments, **options):
        process = ChildProcess(
            module, arguments, environment={"PYTHONPATH": str(tmp_path)}, **options
        )
        started.append(process)
        return process

    yield child
    for process in started:
        process.stop()


def test_it_is_ready_says_things_and_ends_with_its_input(child):
    with child("a_child", "home") as process:
        assert process.wait_ready(20.0)
        assert (process.first_line, process.exit_code) == ("ready at home", None)
        process.stop()
        assert (process.exit_code, process.said) == (0, "a note")
        process.stop()


def test_one_that_ends_at_once_is_not_waited_for(child):
    ended = threading.Event()
    with child("no_child", on_change=ended.set) as process:
        assert not process.wait_ready(20.0)
        assert ended.wait(60.0)
        assert (process.exit_code, process.said, process.first_line) == (1, "not today", "")


def test_one_that_hears_nothing_is_killed(child, tmp_path, monkeypatch):
    from actionlib_core.shutdown import child_process

    monkeypatch.setattr(child_process, "GRACE_S", 0.05)
    monkeypatch.setattr(child_process, "LAST_GRACE_S", 0.05)
    (tmp_path / "deaf.py").write_text(
        "import signal, threading\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "print('ready', flush=True)\n"
        "threading.Event().wait()\n"
    )
    with child("deaf") as process:
        assert process.wait_ready(20.0)
        process.let_go()
        process.stop()
        assert process._ended.wait(60.0)
        assert process.exit_code == -9


def test_the_end_is_told_with_the_exit_code(child):
    codes = []
    process = child("a_child", "--bad", on_change=lambda: codes.append(process.exit_code))
    with process:
        assert process.wait_ready(20.0)
    assert codes == [None, 3]
    assert sys.executable in process._command


def test_a_module_in_the_current_folder_takes_no_other_s_place(child, tmp_path, monkeypatch):
    folder = tmp_path / "here"
    folder.mkdir()
    (folder / "a_child.py").write_text("raise SystemExit('the wrong one')")
    monkeypatch.chdir(folder)
    with child("a_child") as process:
        assert process.wait_ready(20.0), process.said
