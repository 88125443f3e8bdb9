"""`smachpy run` with somebody who watches: a page, a file, nobody at all."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from smachpy.events.recording import read_recording

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(120)]

MISSION = """
import smachpy

class Wait(smachpy.State):
    def __init__(self):
        super().__init__(outcomes=["done"])

    def execute(self, userdata):
        self.sleep(2.5)
        return "done"

def mission():
    sm = smachpy.StateMachine(outcomes=["succeeded"], name="NAP")
    with sm:
        sm.add("WAIT", Wait(), {"done": "succeeded"})
    return sm
"""


@pytest.fixture
def run(tmp_path):
    path = tmp_path / "nap.py"
    path.write_text(MISSION)
    started = []

    def run(*arguments):
        process = subprocess.Popen(
            [sys.executable, "-m", "smachpy.command", "run", str(path), "--plain", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def viewer_of(process):
    """The process id of the viewer that a mission has started."""
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        for word in (task / "children").read_text().split():
            if b"view" in Path(f"/proc/{word}/cmdline").read_bytes().split(b"\0"):
                return int(word)
    raise AssertionError("no viewer")


def test_a_page_and_a_file_of_a_run(run, tmp_path):
    process = run("--view", "--port", "0", "--record", str(tmp_path / "runs" / "nap.jsonl"))
    line = process.stdout.readline()
    assert line.startswith("watch it at http://127.0.0.1:")
    assert "token" not in line
    with urllib.request.urlopen(line.split()[-1], timeout=10) as page:
        assert b"smachpy" in page.read()
    process.stdout.read()
    assert process.wait(20) == 0
    recording = read_recording(tmp_path / "runs" / "nap.jsonl")
    assert recording.events[-1]["kind"] == "Finished"


@pytest.mark.parametrize("what", [signal.SIGKILL, signal.SIGSTOP])
def test_a_viewer_that_is_killed_or_hangs_does_not_stop_the_mission(run, what):
    process = run("--view", "--port", "0", "--control")
    assert "#token=" in process.stdout.readline()
    os.kill(viewer_of(process), what)
    process.stdout.read()
    assert process.wait(20) == 0


def test_a_run_is_not_overwritten_and_a_port_may_be_taken(run, tmp_path):
    file = tmp_path / "there.jsonl"
    file.write_text("mine")
    process = run("--record", str(file))
    assert "the file exists" in process.stdout.read()
    assert process.wait(20) == 2
    assert file.read_text() == "mine"
