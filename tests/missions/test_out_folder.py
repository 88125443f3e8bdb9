"""What `smachpy run --out` leaves when the package that draws tracks is missing."""

from __future__ import annotations

import sys

import pytest

import smachpy
from missions.maps import OFFICE_MAP, OFFICE_ROBOT
from missions.move_base.geometry import Pose2D
from missions.out_folder import OutFolder
from missions.stage import RobotOptions
from missions.waypoint_file import goal_at
from smachpy import events as ev
from viz import History


@pytest.fixture
def no_pillow(monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.delitem(sys.modules, "missions.move_base.track", raising=False)


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
    history = History()
    forget = machine.subscribe(history.on_event)
    with folder.collecting():
        machine.execute()
    forget()
    if drives:
        goal = goal_at(Pose2D(1, 1, 0))
        folder._track.on_event(ev.GoalSent("/M/ONE", 0.0, 0, "move_base", "g", goal))
    written = folder.write(history, {"outcome": "done"})
    assert sorted(path.name for path in written) == ["m.jsonl", "m.svg", "m_summary.json"]
    told = "m_track.png: not drawn: package 'PIL' is missing. Try: pip install 'smachpy[sim]'"
    assert (told in caplog.text) == drives
