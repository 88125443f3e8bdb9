"""The states that mission files name: each is made from plain data."""

from __future__ import annotations

from typing import Any

import pytest

from smachpy import InvalidStateError, StateMachine
from smachpy.states.by_name import BY_NAME

GOAL = {"target_pose": {"header": {"frame_id": "map"}}}
ARGUMENTS: dict[str, list[dict[str, Any]]] = {
    "action": [
        {"name": "move_base", "type": "move_base_msgs/MoveBase", "goal": GOAL},
        {"name": "move_base", "type": "move_base_msgs/MoveBase", "goal_key": "goal"},
    ],
    "ask": [{"question": "Go?", "answers": ["a", "b"], "patience": 3}],
    "await_message": [{"topic": "t", "type": "std_msgs/Bool", "until": "data"}],
    "compute": [{"index": "index + 1"}],
    "drive_to": [{"x": 1.0, "y": 2.0}, {"place": "home"}],
    "locate": [{}],
    "monitor": [{"topic": "t", "type": "std_msgs/Bool", "valid_while": "data"}],
    "nav2_active": [{"timeout": 5.0}],
    "restore_parameters": [{}, {"before": "speeds", "timeout": None}],
    "service": [{"name": "s", "type": "std_srvs/SetBool", "request": {"data": True}}],
    "set": [{"a": 1, "b": [2]}],
    "set_lifecycle": [{"node": "map_server"}, {"node": "map_server", "state": "inactive"}],
    "set_parameters": [{"node": "controller_server", "values": {"max_vel_x": 0.2}}],
    "turn": [{"degrees": 90}],
    "wait": [{"seconds": 1}, {}],
}


def test_the_arguments_of_every_state_are_tried_here():
    assert set(ARGUMENTS) == set(BY_NAME)


@pytest.mark.parametrize(("name", "given"), [(n, a) for n, all_ in ARGUMENTS.items() for a in all_])
def test_it_is_made_from_plain_data_and_has_the_outcomes_that_it_says(name, given):
    state = BY_NAME[name](**given)
    said = BY_NAME[name].__doc__ or ""
    for outcome in state.get_registered_outcomes():
        assert f"'{outcome}'" in said or name == "ask"


def test_compute_reads_and_writes_the_userdata():
    sm = StateMachine(["done"], userdata={"a": 2})
    sm.add("A", BY_NAME["compute"](b="a * 3", c="b + 1"), {"done": "B"})
    sm.add("B", BY_NAME["set"](d="x"))
    sm.userdata.b = 0
    sm.execute()
    assert (sm.userdata.b, sm.userdata.c, sm.userdata.d) == (6, 7, "x")


@pytest.mark.parametrize(
    ("name", "given"),
    [("drive_to", {}), ("drive_to", {"place": "a", "x": 1, "y": 2}), ("compute", {"a": "("})],
)
def test_wrong_arguments_are_refused(name, given):
    with pytest.raises(InvalidStateError):
        BY_NAME[name](**given)
