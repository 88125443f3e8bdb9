from __future__ import annotations

from pathlib import Path

import pytest

import smachpy.sim.interfaces
import smachpy_missions.interfaces
from actionlib_core.interfaces._registry import Registry
from actionlib_core.interfaces._sources import BUNDLED, Sources
from actionlib_core.interfaces._stubs import package_stubs


@pytest.mark.parametrize("module", [smachpy_missions.interfaces, smachpy.sim.interfaces])
def test_the_types_for_editors_are_those_of_the_definitions(module):
    folder = Path(module.__file__).parent
    stubs = package_stubs(Registry(Sources(folders=[folder, BUNDLED])), "mission_msgs")
    assert (folder / "__init__.pyi").read_text() == stubs["mission_msgs/msg.pyi"]
    services = folder / "srv.pyi"
    assert (services.read_text() if services.exists() else None) == stubs.get(
        "mission_msgs/srv.pyi"
    )


def test_one_package_of_definitions_may_lie_in_two_folders():
    feedback = smachpy.sim.interfaces.ChargeFeedback(charge=0.5, seconds_left=2.0)
    assert smachpy.sim.interfaces.ChargeFeedback.from_bytes(feedback.to_bytes()) == feedback
    goal = smachpy_missions.interfaces.CountdownGoal(seconds=3)
    assert smachpy_missions.interfaces.CountdownGoal.from_bytes(goal.to_bytes()) == goal
