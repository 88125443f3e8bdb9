"""`smachpy run` with somebody who watches: a page, a file, nobody at all."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import pytest

from actionlib_core import shutdown
from smachpy.command import main, runs_folder
from smachpy.command.watching import Watch
from smachpy.events import recording
from smachpy.events.recording import read_recording

pytestmark = pytest.mark.zenoh

MISSION = """
from pathlib import Path

import smachpy

class Wait(smachpy.State):
    def __init__(self):
        super().__init__(outcomes=["done", "preempted"])

    def execute(self, userdata):
        while not Path(__file__).with_name("over").exists():
            if self.sleep(0.05):
                return "preempted"
        return "done"

def mission():
    sm = smachpy.StateMachine(outcomes=["succeeded", "preempted"], name="NAP")
    with sm:
        sm.add("WAIT", Wait(), {"done": "succeeded"})
    return sm
"""


@pytest.fixture
def run(tmp_path):
    path = tmp_path / "nap.py"
    path.write_text(MISSION)
    started = []
    environment = {**os.environ, "SMACHPY_RUNS": str(tmp_path / "kept")}

    def run(*arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", "smachpy.command", "run", str(path), "--plain", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=environment,
        )
        started.append(process)
        return process

    run.over = path.with_name("over")  # as soon as it is there the mission ends
    yield run
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def viewer_of(process):
    """The process id of the viewer that a mission has started."""
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # another one has ended
            for word in (task / "children").read_text().split():
                if b"view" in Path(f"/proc/{word}/cmdline").read_bytes().split(b"\0"):
                    return int(word)
    raise AssertionError("no viewer")


@pytest.mark.slow
def test_a_page_and_a_file_of_a_run(run, tmp_path):
    file = tmp_path / "runs" / "nap.jsonl"
    process = run("--view", "--view-for", "0", "--port", "0", "--record", str(file))
    line = process.stdout.readline()
    assert line.startswith("watch it at http://127.0.0.1:")
    assert "token" not in line
    with urllib.request.urlopen(line.split()[-1], timeout=60) as page:
        assert b"smachpy" in page.read()
    run.over.touch()
    process.stdout.read()
    assert process.wait(60) == 0
    recording = read_recording(tmp_path / "runs" / "nap.jsonl")
    assert recording.events[-1]["kind"] == "Finished"


@pytest.mark.slow
@pytest.mark.parametrize("what", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_is_killed_or_hangs_does_not_stop_the_mission(run, what):
    process = run("--view", "--view-for", "0", "--port", "0", "--control")
    assert "#token=" in process.stdout.readline()
    os.kill(viewer_of(process), what)
    run.over.touch()
    process.stdout.read()
    assert process.wait(60) == 0


def read_until(process, word):
    """The lines up to the one with `word`, which is the last."""
    lines = []
    for line in process.stdout:
        lines.append(line.rstrip())
        if word in line:
            return lines
    raise AssertionError(f"no {word!r} in {lines}")


def summary_at(address):
    with urllib.request.urlopen(f"{address}api/machines", timeout=60) as answer:
        (one,) = json.load(answer)
    return one


def test_the_command_that_replays_a_run_can_be_copied(capsys):
    file = SimpleNamespace(path=Path("my runs/a.jsonl"), close=lambda: None)
    watch = Watch(file, SimpleNamespace(exit_code=0), 0.0)
    with shutdown.use_shutdown(shutdown.Shutdown()) as ending:
        watch.linger("done", ending)
    assert capsys.readouterr().out == "recorded: smachpy view 'my runs/a.jsonl'\n"


@pytest.mark.slow
def test_the_page_stays_after_the_end_until_ctrl_c(run, tmp_path):
    run.over.touch()
    process = run("--view", "--port", "0")
    address = process.stdout.readline().split()[-1]
    recorded, still = read_until(process, "still at")[-2:]
    assert address in still
    assert "ended: succeeded" in still
    deadline = time.monotonic() + 60
    while (one := summary_at(address))["outcome"] is None:  # its last event is on the way
        assert time.monotonic() < deadline
    assert (one["outcome"], one["stale"]) == ("succeeded", None)
    (kept,) = (tmp_path / "kept").iterdir()
    assert recorded == f"recorded: smachpy view {kept}"
    assert read_recording(kept).events[-1]["kind"] == "Finished"
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0  # as the mission ended


@pytest.mark.slow
def test_a_run_in_faster_time_is_seen_and_keeps_the_real_date(run, tmp_path):
    run.over.touch()
    process = run("--time", "2x", "--view", "--port", "0")
    address = read_until(process, "watch it at")[-1].split()[-1]
    read_until(process, "still at")
    deadline = time.monotonic() + 60
    while (one := summary_at(address))["outcome"] is None:
        assert time.monotonic() < deadline
    assert one["outcome"] == "succeeded"
    (kept,) = (tmp_path / "kept").iterdir()
    recording = read_recording(kept)
    assert abs(recording.made_ns / 1e9 - time.time()) < 600
    assert recording.stamp_ns == recording.events[0]["stamp_ns"] != recording.made_ns
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 0


@pytest.mark.slow
def test_the_page_stays_for_the_time_that_was_said(run):
    run.over.touch()
    process = run("--view", "--view-for", "0.3s", "--port", "0")
    assert "for 0.3 s" in read_until(process, "still at")[-1]
    assert process.wait(60) == 0


@pytest.mark.slow
def test_a_viewer_that_ends_ends_the_wait(run):
    run.over.touch()
    process = run("--view", "--port", "0")
    read_until(process, "still at")
    os.kill(viewer_of(process), signal.SIGKILL)
    assert process.wait(60) == 0


@pytest.mark.slow
def test_ctrl_c_while_it_runs_ends_all(run):
    process = run("--view", "--port", "0")
    read_until(process, "NAP  started")
    process.send_signal(signal.SIGINT)
    process.stdout.read()
    assert process.wait(60) == 128 + signal.SIGINT


@pytest.mark.parametrize("wrong", ["-1", "ten", "1d", "nan", "inf", "", "1e3", "5 m"])
def test_a_time_for_the_page_that_is_none_is_refused(wrong, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["run", "nap.py", "--view", f"--view-for={wrong}"])
    assert ended.value.code == 2
    assert f"got {wrong!r}; expected a time such as" in capsys.readouterr().err


@pytest.mark.slow
def test_a_folder_of_runs_that_cannot_be_written_stops_nothing(run, tmp_path):
    run.over.touch()
    (tmp_path / "kept").write_text("a file")
    process = run("--view", "--view-for", "0", "--port", "0")
    assert "kept nowhere" in process.stdout.read()
    assert process.wait(60) == 0


def test_the_folder_of_runs_keeps_the_newest_and_what_is_not_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv(runs_folder.VARIABLE, str(tmp_path))
    for number in range(runs_folder.MAX_KEPT_RECORDINGS + 3):
        path = tmp_path / f"nap-20260101-000000-{number}.jsonl"
        path.write_text("")
        recording.notes_file(path).write_text("[]")
        os.utime(path, (number, number))
    (tmp_path / "mine.jsonl").write_text("")
    new = runs_folder.new_file("../a b", 1_700_000_000_000_000_000)
    assert new.parent == tmp_path
    assert new.name.startswith(".._a_b-2023111")
    assert not recording.notes_file(tmp_path / "nap-20260101-000000-3.jsonl").exists()
    left = {path.name for path in tmp_path.glob("*.jsonl")}
    assert len(left) == runs_folder.MAX_KEPT_RECORDINGS  # with mine, and room for the new one
    assert "mine.jsonl" in left
    assert "nap-20260101-000000-3.jsonl" not in left
    assert f"nap-20260101-000000-{runs_folder.MAX_KEPT_RECORDINGS + 2}.jsonl" in left


def test_a_clock_that_was_put_back_lets_the_newest_recordings_stay(tmp_path, monkeypatch):
    monkeypatch.setenv(runs_folder.VARIABLE, str(tmp_path))
    future = 4e9
    for number in range(runs_folder.MAX_KEPT_RECORDINGS):
        path = tmp_path / f"nap-20960101-000000-{number}.jsonl"
        path.write_text("")
        os.utime(path, (future + number, future + number))
    newest = tmp_path / "nap-20260101-000000-1.jsonl"
    newest.write_text("")
    assert runs_folder.new_file("nap", 1_700_000_000_000_000_000) is not None
    left = {path.name for path in tmp_path.glob("*.jsonl")}
    assert newest.name in left
    assert "nap-20960101-000000-1.jsonl" not in left
    assert "nap-20960101-000000-2.jsonl" in left


def test_the_folder_of_runs_goes_by_the_environment():
    assert runs_folder.runs_folder({"XDG_STATE_HOME": "/s"}) == Path("/s/smachpy/runs")
    assert runs_folder.runs_folder({"SMACHPY_RUNS": "/r", "XDG_STATE_HOME": "/s"}) == Path("/r")
    assert runs_folder.runs_folder({}) == Path.home() / ".local/state/smachpy/runs"


def test_a_run_is_not_overwritten_and_a_port_may_be_taken(run, tmp_path):
    file = tmp_path / "there.jsonl"
    file.write_text("mine")
    process = run("--record", str(file))
    assert "the file exists" in process.stdout.read()
    assert process.wait(60) == 2
    assert file.read_text() == "mine"


def test_a_user_without_a_home_has_a_folder_for_runs(monkeypatch, tmp_path):
    """`--view` and `smachpy view` ended with a traceback."""

    def homeless(_self):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", homeless)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    folder = runs_folder.runs_folder({})
    assert folder.parent.parent == tmp_path
    assert str(os.getuid()) in folder.parent.name
