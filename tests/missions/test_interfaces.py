from __future__ import annotations

from pathlib import Path

import missions.interfaces
from actionlib_core.interfaces._registry import registry
from actionlib_core.interfaces._stubs import package_stubs


def test_the_types_for_editors_are_those_of_the_action_files():
    stubs = package_stubs(registry, "mission_msgs")
    stub = Path(missions.interfaces.__file__).with_suffix(".pyi")
    assert stub.read_text() == stubs["mission_msgs/msg.pyi"]
    assert stub.with_name("srv.pyi").read_text() == stubs["mission_msgs/srv.pyi"]


def test_messages_survive_the_wire():
    feedback = missions.interfaces.ChargeFeedback(charge=0.5, seconds_left=2.0)
    assert missions.interfaces.ChargeFeedback.from_bytes(feedback.to_bytes()) == feedback
