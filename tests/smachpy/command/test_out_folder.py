"""What `smachpy run --out` leaves when the package that draws tracks is missing."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import smachpy
from smachpy import events as ev
from smachpy.command import main
from smachpy.command.out_folder import OutFolder
from smachpy.command.surroundings import RobotOptions
from smachpy.places.maps import OFFICE_MAP, OFFICE_ROBOT
from smachpy.places.pose import Pose2D
from smachpy.states import goal_at


@pytest.fixture
def no_pillow(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.delitem(sys.modules, "smachpy.sim.track", raising=False)


@pytest.fixture
def machine():
    sm = smachpy.StateMachine(["done"], name="M")
    with sm:
        sm.add("ONE", smachpy.CBState(lambda _userdata: "done", outcomes=["done"]))
    return sm


@pytest.mark.parametrize("drives", [False, True])
def test_without_pillow_all_but_the_track_is_written_and_the_extra_is_named(
    no_pillow, machine, drives, tmp_path, caplog
):
    folder = OutFolder(tmp_path, "m", machine, RobotOptions(False, OFFICE_MAP, OFFICE_ROBOT))
    with folder.collecting():
        machine.execute()
    if drives:
        goal = goal_at(Pose2D(1, 1, 0))
        folder._track.on_event(ev.GoalSent("/M/ONE", 0.0, 0, "move_base", "g", goal))
    written = folder.write({"outcome": "done"})
    assert sorted(path.name for path in written) == ["m.jsonl", "m.svg", "m_summary.json"]
    told = "m_track.png: not drawn: package 'PIL' is missing. Try: pip install 'smachpy[sim]'"
    assert (told in caplog.text) == drives


def test_two_missions_of_one_file_do_not_replace_each_others_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("two.py").write_text(
        "from smachpy import CBState, StateMachine\n\n"
        "def inspect():\n"
        "    sm = StateMachine(['done'])\n"
        "    sm.add('ONE', CBState(lambda _: 'done', outcomes=['done']))\n"
        "    return sm\n\n"
        "patrol = two = inspect\n",
        encoding="utf-8",
    )
    for target in ("two.py:inspect", "two.py:patrol", "two.py:two"):
        assert main(["run", target, "--plain", "--time", "virtual", "--out", "out"]) == 0
    written = {path.name for path in Path("out").glob("*.jsonl")}
    assert written == {"two_inspect.jsonl", "two_patrol.jsonl", "two.jsonl"}
