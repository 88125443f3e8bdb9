"""Names of ours on a network of ROS 2: the configuration, and what becomes of types and messages."""

from __future__ import annotations

from dataclasses import replace

import pytest

from actionlib_core import interfaces
from actionlib_core.clock import RealClock
from actionlib_core.config import Config, Mapped, Ros2, load_config
from actionlib_core.exceptions import ActionException, ConfigError
from actionlib_core.interfaces import ros2
from actionlib_core.interfaces.control_msgs.msg import GripperCommandAction
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import Node
from actionlib_core.transport.memory import MemoryNetwork
from actionlib_core.wire.action_types import ActionTypes
from actionlib_core.wire.ros2.mapping import (
    action_on_ros2,
    find_network,
    message_on_ros2,
    service_on_ros2,
)

MOVE_BASE = ActionTypes.of(MoveBaseAction)


def test_a_file_says_what_is_where(tmp_path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "ros2:\n"
        "  router: tcp/127.0.0.1:7447\n"
        "  names: [odom]\n"
        "  map:\n"
        "    move_base: {action: navigate_to_pose, type: nav2_msgs/NavigateToPose}\n"
        "    arm/go: {type: a_msgs/Go, fields: {goal.target: pose}}\n"
    )
    (network,) = load_config(path).ros2
    assert network.map == (
        Mapped("move_base", action="navigate_to_pose", type="nav2_msgs/NavigateToPose"),
        Mapped("arm/go", type="a_msgs/Go", fields=(("goal.target", "pose"),)),
    )
    assert [entry.name_there for entry in network.map] == ["navigate_to_pose", "arm/go"]


def test_which_names_are_on_ros2() -> None:
    clock = RealClock()
    networks = (
        Ros2(names=("odom", "robot1/**"), map=(Mapped("move_base", action="go"),)),
        Ros2(robot="robot2"),
    )
    node = Node(
        "mission",
        clock=clock,
        transport=MemoryNetwork(clock).session(),
        config=Config(ros2=networks),
    )
    for name in ("odom", "robot1/scan", "move_base"):
        assert find_network(node, name, MoveBaseAction) is networks[0]
    assert find_network(node, "robot2/move_base", MoveBaseAction) is networks[1]
    assert find_network(node, "scan", MoveBaseAction) is None
    assert find_network(node, "robot2/spin", NavigateToPose) is networks[1]
    with pytest.raises(ConfigError):
        find_network(node, "spin", NavigateToPose)


def test_all_names_are_those_of_robots() -> None:
    clock = RealClock()
    network = Ros2(names=("**", "lamp"))
    node = Node(
        "mission",
        clock=clock,
        transport=MemoryNetwork(clock).session(),
        config=Config(ros2=(network,)),
    )
    scan, text = (
        interfaces.get_message(name) for name in ("sensor_msgs/LaserScan", "std_msgs/String")
    )
    for cls in (
        MoveBaseAction,
        GripperCommandAction,
        scan,
        interfaces.get_service("nav_msgs/GetMap"),
    ):
        assert find_network(node, "a/b", cls) is network
    for cls in (text, SetBool):
        assert find_network(node, "a/b", cls) is None
        assert find_network(node, "lamp", cls) is network
    assert find_network(node, "a/b", interfaces.get_message("actionlib_msgs/GoalID")) is None


def test_the_environment_names_a_robot(monkeypatch, tmp_path) -> None:
    monkeypatch.delenv("SMACHPY_CONFIG", raising=False)
    monkeypatch.setenv("SMACHPY_ROS2", "tcp/127.0.0.1:7447")
    monkeypatch.setenv("SMACHPY_ROS2_DOMAIN", "42")
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "Kilted")
    expected = Ros2("tcp/127.0.0.1:7447", 42, "kilted", names=("**",))
    assert load_config().ros2 == (expected,)
    path = tmp_path / "robot.yaml"
    path.write_text("ros2: {router: tcp/127.0.0.1:1, names: [odom]}\n")
    assert load_config(path).ros2 == (replace(expected, names=("odom",)),)
    path.write_text("ros2: [{robot: a}, {robot: b}]\n")
    with pytest.raises(ConfigError, match="2 networks"):
        load_config(path)
    monkeypatch.setenv("SMACHPY_ROS2_DISTRO", "kiltd")
    with pytest.raises(ConfigError, match="kiltd"):
        load_config()
    monkeypatch.setenv("SMACHPY_ROS2_DOMAIN", "x")
    with pytest.raises(ConfigError, match="SMACHPY_ROS2_DOMAIN"):
        load_config()


def test_move_base_is_navigate_to_pose_without_being_told() -> None:
    found = action_on_ros2(Ros2(), "robot1/move_base", MOVE_BASE)
    assert (found.name, found.action) == ("robot1/navigate_to_pose", NavigateToPose)
    goal = MoveBaseGoal()
    goal.target_pose.header.frame_id = "map"
    assert found.to_goal(goal).pose.header.frame_id == "map"
    assert found.from_goal(found.to_goal(goal)) == goal
    assert found.from_result(NavigateToPose.Result(error_code=3)) == MOVE_BASE.result()
    assert found.from_feedback(NavigateToPose.Feedback()).base_position.header.frame_id == ""
    assert action_on_ros2(Ros2(), "drive", MOVE_BASE).name == "drive"


def test_the_configuration_has_the_last_word() -> None:
    settings = Ros2(
        distro="kilted",
        map=(
            Mapped(
                "move_base",
                action="/dock",
                type="nav2_msgs/DockRobot",
                fields=(
                    ("goal.target_pose", "goal.dock_pose"),
                    ("feedback.base_position", ""),
                ),
            ),
        ),
    )
    found = action_on_ros2(settings, "move_base", MOVE_BASE)
    assert (found.name, found.action._type) == ("dock", "nav2_msgs/action/DockRobot")
    assert found.to_goal(MoveBaseGoal()).use_dock_id is True
    wrong = Ros2(map=(Mapped("move_base", type="nav2_msgs/Spin"),))
    with pytest.raises(ConfigError) as caught:
        action_on_ros2(wrong, "move_base", MOVE_BASE)
    assert len(caught.value.problems) == 2
    # The way out that is named works.
    assert "Try 'fields: {goal.target_pose: ...}'" in caught.value.problems[0]
    without = (("goal.target_pose", ""), ("feedback.base_position", ""))
    mapped = Mapped("move_base", type="nav2_msgs/Spin", fields=without)
    assert action_on_ros2(Ros2(map=(mapped,)), "move_base", MOVE_BASE).name == "move_base"
    with pytest.raises(ConfigError, match="nav2_msgs/Spinn"):
        action_on_ros2(Ros2(map=(Mapped("a", type="nav2_msgs/Spinn"),)), "a", MOVE_BASE)


def test_a_mapped_name_without_a_type_keeps_the_known_successor() -> None:
    settings = Ros2(map=(Mapped("move_base", action="/drive_to"),))
    found = action_on_ros2(settings, "move_base", MOVE_BASE)
    assert (found.name, found.action) == ("drive_to", NavigateToPose)
    # With a type alone, the name is the same there, as for all mapped names.
    settings = Ros2(map=(Mapped("move_base", type="nav2_msgs/NavigateToPose"),))
    assert action_on_ros2(settings, "move_base", MOVE_BASE).name == "move_base"


@pytest.mark.parametrize("name", ["/move_base", "move_base/", "a//b"])
def test_a_mapped_name_that_would_never_be_found_is_refused(name) -> None:
    with pytest.raises(ConfigError, match="without outer slashes"):
        Mapped(name, action="go")


@pytest.mark.parametrize("pair", [
    ("target_pose", "pose"), ("gaol.target_pose", "goal.pose"), ("goal.target_pose", "result.pose"),
    ("goal.", "goal.pose"),
])  # fmt: skip
def test_fields_of_no_part_of_an_action_are_named(pair) -> None:
    settings = Ros2(map=(Mapped("move_base", action="go", fields=(pair,)),))
    with pytest.raises(ConfigError, match=f"fields: got '{pair[0]}: {pair[1]}'; expected one of"):
        action_on_ros2(settings, "move_base", MOVE_BASE)


def test_another_distribution_takes_the_goals_of_a_class() -> None:
    found = action_on_ros2(Ros2(distro="rolling"), "go", ActionTypes.of(NavigateToPose))
    assert found.action._distro == "rolling"
    assert type(found.to_goal(NavigateToPose.Goal())) is found.action.Goal
    assert type(found.from_feedback(found.action.Feedback())) is NavigateToPose.Feedback
    with pytest.raises(ConfigError, match="error_code") as caught:
        action_on_ros2(Ros2(distro="humble"), "go", ActionTypes.of(NavigateToPose))
    result = "nav2_msgs/action/NavigateToPose_Result"
    assert caught.value.problems[0] == (
        f"{result} (jazzy) -> {result} (humble): error_code: got a field without counterpart; "
        "expected one of result. Try the class of humble, with SMACHPY_ROS2_DISTRO=humble."
    )


def test_actions_of_one_name_in_both_worlds() -> None:
    found = action_on_ros2(Ros2(), "gripper", ActionTypes.of(GripperCommandAction))
    assert found.action._type == "control_msgs/action/GripperCommand"


def test_topics_and_services() -> None:
    odometry = interfaces.get_message("nav_msgs/Odometry")
    topic = message_on_ros2(Ros2(map=(Mapped("odom", topic="wheels/odom"),)), "odom", odometry)
    assert (topic.name, topic.message._type) == ("wheels/odom", "nav_msgs/msg/Odometry")
    assert topic.from_ros2(topic.to_ros2(odometry())) == odometry()
    service, request, response = service_on_ros2(Ros2(), "flag", SetBool)
    assert service._type == "std_srvs/srv/SetBool"
    assert request.to_ros2(SetBool._request_class(data=True)).data is True
    assert response.from_ros2(response.message(message="x")).message == "x"
    switch = interfaces.define_service("mapping_pkg/Switch", "bool on\nbool slow\n---\nbool ok\n")
    pairs = (("request.on", "data"), ("request.slow", ""))
    mapped = Mapped("flag", type="std_srvs/SetBool", fields=pairs)
    _, request, _ = service_on_ros2(Ros2(map=(mapped,)), "flag", switch)
    assert request.to_ros2(switch._request_class(on=True)).data is True
    mapped = Mapped("flag", type="std_srvs/SetBool", fields=(*pairs, ("reqest.on", "data")))
    with pytest.raises(ConfigError, match=r"reqest\.on"):
        service_on_ros2(Ros2(map=(mapped,)), "flag", switch)
    own = interfaces.define_message("mapping_pkg/Old", "time at\n")
    with pytest.raises(ConfigError, match="mapping_pkg"):
        message_on_ros2(Ros2(), "old", own)


@pytest.mark.parametrize("wrong", [NavigateToPose.Goal, ros2.get_message("std_msgs/String")])
def test_what_is_no_action_of_ros_2_is_told_where_those_are(wrong) -> None:
    with pytest.raises(ActionException, match=r"nav2_msgs\.action\.NavigateToPose\. .*'action'"):
        ActionTypes.of(wrong)
