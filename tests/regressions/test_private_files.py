"""What is written of missions is for their user only, whatever the umask is."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from actionlib_core import SimpleActionServer
from actionlib_core.interfaces.actionlib.msg import TestAction
from actionlib_core.node import Node, use_node
from actionlib_core.process.private_files import make_private_folder, open_private
from actionlib_core.transport.memory import MemoryNetwork
from smachpy.command import main
from smachpy_viz.live.journals import Journals
from smachpy_viz.live.simulations import Simulations

MISSION = """
import smachpy

@smachpy.state(outcomes=["done"], output_keys=["word"])
def work(userdata):
    userdata.word = "of a person"
    return "done"

def mission():
    machine = smachpy.StateMachine(["done"], name="M")
    machine.add("A", work)
    return machine
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    Path("mission.py").write_text(MISSION)
    before = os.umask(0o022)
    yield tmp_path
    os.umask(before)


def open_ones(*, leave=()):
    """The files and folders that others may read, besides those of the test itself."""
    mine = {"mission.py", "__pycache__", *leave}
    return [
        (oct(stat.S_IMODE(path.stat().st_mode)), str(path))
        for path in sorted(Path().rglob("*"))
        if not mine & {*path.parts, path.suffix} and path.stat().st_mode & 0o077
    ]


def test_journals_and_recordings_of_a_run():
    run = ["run", "mission.py", "--plain", "--durable", "kept/j.db", "--record", "runs/1.jsonl"]
    assert main(run) == 0
    assert main(["run", "mission.py", "--plain", "--time", "virtual", "--out", "out"]) == 0
    # Pictures show the machine, not its values.
    assert open_ones(leave={".svg"}) == []
    assert {path.name for path in Path().rglob("*.*")} >= {
        "j.db",
        "1.jsonl",
        "mission_summary.json",
    }


def test_recordings_of_simulated_runs():
    assert main(["simulate", "mission.py", "--runs", "2", "--record", "a/b"]) == 0
    assert len(list(Path("a/b").glob("*.jsonl"))) == 2
    assert open_ones() == []


def test_goals_of_an_action_server(clock):
    with use_node(Node("robot", clock=clock, transport=MemoryNetwork(clock).session())) as node:
        server = SimpleActionServer("dig", TestAction, lambda goal: None, False, durable="f/dig.db")
        server.start()
        server.stop()
        node.close()
    assert Path("f/dig.db").stat().st_size
    assert open_ones() == []


def test_logs_and_batches_of_the_page():
    page = Journals([], logs=Path("state/resumed"))
    page._log_file("m1").close()
    batches = Simulations(Path("state/simulated"))
    batches.start({"mission": "countdown", "runs": 1})
    batches.close()
    assert len(list(Path("state").rglob("*.*"))) >= 2
    assert open_ones() == []


def test_what_exists_keeps_its_mode():
    Path("shared").mkdir(mode=0o755)
    Path("shared/file").write_text("x")
    make_private_folder(Path("shared"))
    with open_private(Path("shared/file"), "a") as file:
        file.write("y")
    assert Path("shared/file").read_text() == "xy"
    assert stat.S_IMODE(Path("shared").stat().st_mode) == 0o755
    assert stat.S_IMODE(Path("shared/file").stat().st_mode) == 0o644
