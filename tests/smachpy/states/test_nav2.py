"""The states for Nav2: costmaps, docks and waypoints."""

from __future__ import annotations

import math

import pytest

from actionlib_core.exceptions import InterfaceError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
from actionlib_core.interfaces.nav2_msgs.action import DockRobot, FollowWaypoints, UndockRobot
from actionlib_core.interfaces.std_srvs.srv import Empty
from smachpy import InvalidStateError, StateMachine
from smachpy.states import (
    Pose2D,
    Waypoint,
    clear_costmaps,
    dock,
    follow_waypoints,
    goal_at,
    undock,
)

CLEAR = ros2.get_service("nav2_msgs/ClearEntireCostmap")
GLOBAL = "global_costmap/clear_entirely_global_costmap"
LOCAL = "local_costmap/clear_entirely_local_costmap"
PLACE = Pose2D(1.0, 2.0, 0.5)


def alone(state, **userdata):
    sm = StateMachine(state.get_registered_outcomes(), name="ALONE")
    sm.userdata.update(userdata)
    sm.add("STATE", state)
    return sm


def place(stamped):
    return stamped.header.frame_id, stamped.pose.position.x, stamped.pose.position.y


@pytest.mark.parametrize(
    ("make", "problem"),
    [
        (lambda: clear_costmaps(navigation="nav3"), "Did you mean 'nav2'"),
        (lambda: clear_costmaps(timeout=-1), "timeout: got -1"),
        (dock, "dock_id, place: got both or none"),
        (lambda: dock("a", place=PLACE), "dock_id, place: got both or none"),
        (lambda: dock(place=3), "place: got 3; expected a Pose2D"),
        (lambda: dock(place=Pose2D(math.nan, 0.0, 0.0)), "pose: got"),
        (lambda: follow_waypoints([]), "places: got .*; expected a list of places, not empty"),
        (lambda: follow_waypoints([PLACE, "x"]), r"places: \[1\]: got 'x'"),
        (lambda: follow_waypoints([PLACE], loops=-1), "loops: got -1"),
        (lambda: follow_waypoints([PoseStamped(pose=None)]), "places"),
    ],
)
def test_wrong_arguments_are_refused_where_they_are_given(make, problem):
    with pytest.raises(InvalidStateError, match=problem):
        make()


# -- costmaps ----------------------------------------------------------------------------------


@pytest.mark.parametrize("prefix", ["", "robot_0/"])
def test_both_costmaps_are_cleared(mission, prefix):
    servers = [mission.service_server(prefix + name, CLEAR) for name in (GLOBAL, LOCAL)]
    mission(alone(clear_costmaps(namespace=prefix))).assert_outcome("succeeded")
    assert [len(server.requests) for server in servers] == [1, 1]


def test_those_of_move_base_are_cleared(mission):
    server = mission.service_server("move_base/clear_costmaps", Empty)
    mission(alone(clear_costmaps(navigation="move_base"))).assert_outcome("succeeded")
    assert len(server.requests) == 1


def test_a_costmap_that_is_not_there_is_told(mission, caplog):
    mission.service_server(GLOBAL, CLEAR)
    mission(alone(clear_costmaps(timeout=2.0))).assert_outcome("aborted")
    assert f"/{LOCAL}: no server" in caplog.text


@pytest.mark.parametrize("after", [0.0, 1.0])
def test_a_preempt_ends_the_wait_for_a_costmap(mission, after):
    mission.service_server(GLOBAL, CLEAR).never_answer()
    mission.preempt(on="GLOBAL", after=after)
    run = mission(alone(clear_costmaps(timeout=None)))
    run.assert_outcome("preempted")
    assert run.duration == after


# -- docks -------------------------------------------------------------------------------------


def test_it_docks_by_name_and_undocks(mission):
    docks = mission.action_server("dock_robot", DockRobot)
    undocks = mission.action_server("undock_robot", UndockRobot)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="CHARGE")
    sm.add("DOCK", dock("home"), {"succeeded": "UNDOCK"})
    sm.add("UNDOCK", undock("simple"))
    mission(sm).assert_outcome("succeeded")
    goal = docks.goals[0]
    assert (goal.use_dock_id, goal.dock_id, goal.navigate_to_staging_pose) == (True, "home", True)
    assert undocks.goals[0].dock_type == "simple"


@pytest.mark.parametrize("given", [PLACE, "here"])
def test_it_docks_at_a_place(mission, given):
    docks = mission.action_server("dock_robot", DockRobot)
    state = dock(place=given, dock_type="simple", navigate=False)
    mission(alone(state, here=goal_at(PLACE, "odom").target_pose)).assert_outcome("succeeded")
    goal = docks.goals[0]
    frame = "map" if given is PLACE else "odom"
    assert (goal.use_dock_id, place(goal.dock_pose)) == (False, (frame, 1.0, 2.0))
    assert goal.dock_pose.pose.orientation.z == pytest.approx(math.sin(0.25))


def test_an_error_of_the_docking_server_has_its_name(mission, caplog):
    docks = mission.action_server("dock_robot", DockRobot)
    docks.reply({"error_code": 904, "error_msg": "no tag seen"}, status="aborted")
    mission(alone(dock("home"))).assert_outcome("aborted")
    assert "dock_robot: FAILED_TO_DETECT_DOCK (904): no tag seen" in caplog.text


def test_a_preempt_cancels_docking(mission):
    docks = mission.action_server("dock_robot", DockRobot)
    docks.never_finish()
    mission.preempt(on="STATE", after=3.0)
    mission(alone(dock("home"))).assert_outcome("preempted")
    assert len(docks.cancelled) == 1


def test_humble_has_no_docks(monkeypatch):
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "humble")
    with pytest.raises(InterfaceError, match="Humble"):
        dock("home")


# -- waypoints ---------------------------------------------------------------------------------

PLACES = [PLACE, Waypoint("desk", Pose2D(3.0, 4.0, 0.0)), goal_at(PLACE, "odom").target_pose]
EXPECTED = [("map", 1.0, 2.0), ("map", 3.0, 4.0), ("odom", 1.0, 2.0)]


@pytest.mark.parametrize("given", [PLACES, "route"])
def test_it_follows_waypoints(mission, given):
    server = mission.action_server("follow_waypoints", FollowWaypoints)
    mission(alone(follow_waypoints(given, loops=2), route=PLACES)).assert_outcome("succeeded")
    assert [place(pose) for pose in server.goals[0].poses] == EXPECTED
    assert server.goals[0].number_of_loops == 2


def test_places_that_were_missed_are_an_outcome_and_a_key(mission):
    server = mission.action_server("follow_waypoints", FollowWaypoints)
    server.reply({"missed_waypoints": [{"index": 1}, {"index": 2}]})
    machine = alone(follow_waypoints(PLACES, missed_key="missed"))
    mission(machine).assert_outcome("missed")
    assert machine.userdata.missed == [1, 2]


def test_humble_lists_missed_places_as_numbers_and_has_no_loops(mission, monkeypatch):
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "humble")
    action = ros2.get_action("nav2_msgs/FollowWaypoints")
    mission.action_server("follow_waypoints", action).reply({"missed_waypoints": [2]})
    machine = alone(follow_waypoints(PLACES, missed_key="missed"))
    mission(machine).assert_outcome("missed")
    assert machine.userdata.missed == [2]
    with pytest.raises(InvalidStateError, match="loops: got 1; expected 0, as Nav2 of humble"):
        follow_waypoints(PLACES, loops=1)


def test_an_aborted_drive_is_aborted_though_places_were_missed(mission):
    server = mission.action_server("follow_waypoints", FollowWaypoints)
    server.reply({"missed_waypoints": [{"index": 0}], "error_code": 601}, status="aborted")
    machine = alone(follow_waypoints(PLACES, missed_key="missed"))
    mission(machine).assert_outcome("aborted")
    assert machine.userdata.missed == [0]


@pytest.mark.parametrize("value", [[], None, "here", [PLACE, 3]])
def test_a_value_that_is_no_list_of_places_is_an_error(mission, value):
    server = mission.action_server("follow_waypoints", FollowWaypoints)
    with pytest.raises(InvalidStateError, match="/ALONE/STATE: route: "):
        mission(alone(follow_waypoints("route"), route=value))
    assert server.goals == []
