"""The states that mission files name: each is made from plain data."""

from __future__ import annotations

from typing import Any

import pytest

import smachpy
from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.nav_msgs.srv import GetPlan
from smachpy import InvalidStateError, StateMachine
from smachpy.states.by_name import BY_NAME, _interface

GOAL = {"target_pose": {"header": {"frame_id": "map"}}}
ARGUMENTS: dict[str, list[dict[str, Any]]] = {
    "action": [
        {"name": "move_base", "type": "move_base_msgs/MoveBase", "goal": GOAL},
        {"name": "move_base", "type": "move_base_msgs/MoveBase", "goal_key": "goal"},
        {"name": "spin", "type": "nav2_msgs/action/Spin", "goal": {"target_yaw": 1.57}},
    ],
    "ask": [{"question": "Go?", "answers": ["a", "b"], "patience": 3}],
    "await_message": [
        {"topic": "t", "type": "std_msgs/Bool", "until": "data"},
        {"topic": "t", "type": "nav2_msgs/SpeedLimit", "key": "limit", "timeout": None},
    ],
    "clear_costmaps": [{}, {"navigation": "move_base", "namespace": "robot_0"}],
    "barrier": [{"name": "LOADED", "parties": 3}],
    "compute": [{"index": "index + 1"}],
    "dock": [{"id": "home"}, {"place": "here", "exec_timeout": None}],
    "drive_to": [{"x": 1.0, "y": 2.0}, {"place": "home"}],
    "follow_waypoints": [{"places": [{"x": 1, "y": 2}], "missed_key": "m"}, {"places": "route"}],
    "locate": [{}],
    "look_up_transform": [{"key": "cup", "frame": "cup"}],
    "monitor": [{"topic": "t", "type": "std_msgs/Bool", "valid_while": "data"}],
    "nav2_active": [{"timeout": 5.0}],
    "publish": [
        {"topic": "t", "type": "std_msgs/Bool", "message": {"data": True}},
        {"topic": "t", "type": "std_msgs/Bool", "key": "k", "subscribers": 0},
    ],
    "record_bag": [{"path": "drive.mcap", "topics": {"odom": "nav_msgs/Odometry"}, "seconds": 5}],
    "restore_parameters": [{}, {"before": "speeds", "timeout": None}],
    "service": [{"name": "s", "type": "std_srvs/SetBool", "request": {"data": True}}],
    "set": [{"a": 1, "b": [2]}],
    "set_lifecycle": [{"node": "map_server"}, {"node": "map_server", "state": "inactive"}],
    "set_parameters": [{"node": "controller_server", "values": {"max_vel_x": 0.2}}],
    "turn": [{"degrees": 90}],
    "undock": [{}],
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


def test_set_writes_the_same_value_each_time_although_states_change_it_in_place():
    found = []

    @smachpy.state(outcomes=["again", "done"], io_keys=["found"])
    def look(userdata):
        userdata.found.append("cup")
        found.append(list(userdata.found))
        return "again" if len(found) < 3 else "done"

    sm = StateMachine(["done"])
    sm.add("SET", BY_NAME["set"](found=[]), {"done": "LOOK"})
    sm.add("LOOK", look, {"again": "SET"})
    sm.execute()
    assert found == [["cup"]] * 3


def test_a_time_that_is_now_is_that_at_which_the_message_is_sent(mission):
    """It was the time at which the file was read."""
    header = {"frame_id": "map", "stamp": "now"}
    place = {"x": 1.0, "y": 2.0}
    goal = {"target_pose": {"header": header, "pose": {"position": place}}}
    sm = StateMachine(["succeeded", "aborted", "preempted", "done"])
    plan = BY_NAME["service"](
        name="plan", type="nav_msgs/GetPlan", request={"goal": {"header": header}}
    )
    drive = BY_NAME["action"](name="move_base", type="move_base_msgs/MoveBase", goal=goal)
    sm.add("WAIT", BY_NAME["wait"](30.0), {"done": "PLAN"})
    sm.add("PLAN", plan, {"succeeded": "DRIVE"})
    sm.add("DRIVE", drive)
    planner = mission.service_server("plan", GetPlan)
    base = mission.action_server("move_base", MoveBaseAction)
    begin = mission.clock.time_ns()
    mission(sm).assert_outcome("succeeded")
    (sent,), (planned,) = base.goals, planner.requests
    for pose in (sent.target_pose, planned.goal):
        assert pose.header.stamp.to_nsec() >= begin + 30_000_000_000
    assert sent.target_pose.pose.position.y == 2.0


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("follow_waypoints", {"places": [{"x": 1.0}]}),
        ("follow_waypoints", {"places": [3]}),
        ("dock", {}),
        ("record_bag", {"path": "/etc/drive.mcap", "topics": {"odom": "nav_msgs/Odometry"}}),
        ("record_bag", {"path": "../drive.mcap", "topics": {"odom": "nav_msgs/Odometry"}}),
        ("drive_to", {}),
        ("drive_to", {"place": "a", "x": 1, "y": 2}),
        ("compute", {"a": "("}),
    ],
)
def test_wrong_arguments_are_refused(name, given):
    with pytest.raises(InvalidStateError):
        BY_NAME[name](**given)


@pytest.mark.parametrize(
    ("kind", "name", "module"),
    [
        ("message", "std_msgs/Bool", "actionlib_core.interfaces.std_msgs.msg"),
        ("message", "std_msgs/msg/Bool", "actionlib_core.interfaces.ros2.std_msgs.msg"),
        ("service", "std_srvs/Trigger", "actionlib_core.interfaces.std_srvs.srv"),
        ("service", "std_srvs/srv/Trigger", "actionlib_core.interfaces.ros2.std_srvs.srv"),
        ("service", "nav2_msgs/LoadMap", "actionlib_core.interfaces.ros2.nav2_msgs.srv"),
        ("action", "nav2_msgs/Spin", "actionlib_core.interfaces.ros2.nav2_msgs.action"),
        (
            "action",
            "move_base_msgs/action/MoveBase",
            "actionlib_core.interfaces.move_base_msgs.msg",
        ),
    ],
)
def test_types_are_those_of_ros_1_or_as_ros_2_writes_them_of_ros_2(kind, name, module):
    """Files could name no type of ROS 2."""
    assert _interface(kind, name).__module__ == module


def test_a_type_that_neither_has_is_told():
    with pytest.raises(InterfaceError, match=r"nav_msgs/Odometri.*Did you mean"):
        _interface("message", "nav_msgs/Odometri")
