from __future__ import annotations

from pathlib import Path

import pytest

import smachpy
from smachpy.command.targets import load_target
from smachpy.machines.mission_info import MissionInfo, mission_info


def make():
    return smachpy.StateMachine(["done"])


def test_it_says_what_the_mission_needs_and_changes_nothing_else():
    marked = smachpy.mission(serves=["turn"], world="doors.yaml", real_time="processes")(make)
    assert marked is make
    assert mission_info(make) == MissionInfo(("turn",), Path("doors.yaml"), "processes")
    del make._smachpy_mission


@pytest.mark.parametrize("thing", [make, None, 3, smachpy.StateMachine(["done"])])
def test_without_it_nothing_is_needed(thing):
    assert mission_info(thing) == MissionInfo()


@pytest.mark.parametrize("serves", ["turn", [3], 7])
def test_serves_is_a_list_of_names(serves):
    with pytest.raises(smachpy.InvalidStateError) as error:
        smachpy.mission(serves=serves)
    assert len(error.value.problems) == 1


@pytest.mark.parametrize("line", ["from smachpy import mission", "from smachpy import *"])
def test_the_imported_decorator_is_not_taken_for_the_mission_of_a_file(tmp_path, line):
    file = tmp_path / "fetch_with_decorator.py"
    file.write_text(f"{line}\nimport smachpy\nsm = smachpy.StateMachine(['done'])\n")
    assert isinstance(load_target(str(file)).build(), smachpy.StateMachine)


def test_the_decorator_needs_no_arguments():
    @smachpy.mission
    def patrol(rounds=1):
        return rounds

    assert patrol(2) == 2
    assert mission_info(patrol) == MissionInfo()
