from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from actionlib_core.action.simple_client import SimpleActionClient
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction
from actionlib_core.interfaces.std_srvs.srv import SetBool
from actionlib_core.node import Node
from actionlib_core.pubsub.service_proxy import ServiceProxy
from smachpy.command import main as smachpy_main
from smachpy.places.maps import FOLDER
from smachpy.places.pose import Pose2D
from smachpy.states import goal_at


def main(words):
    return smachpy_main(["robot", *words])


def test_a_mistake_in_a_world_file_is_one_line_and_nothing_starts(tmp_path, capsys):
    path = tmp_path / "world.yaml"
    path.write_text("robots:\n  - {x: 99, y: 7.1}\n  - {x: 9.8, y: 7.1, name: my robot}\n")
    assert main(["--world", str(path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert f"{path}:2: robots[0].x: got 99; expected a place where the robot can stand" in lines[0]
    assert "world.yaml:3: robots[1].name: got 'my robot'" in lines[1]


def test_robots_on_one_place_are_named(tmp_path, capsys):
    path = tmp_path / "world.yaml"
    path.write_text("robots:\n  - {x: 9.8, y: 7.1}\n  - {x: 9.9, y: 7.1}\n")
    assert main(["--world", str(path)]) == 2
    expected = f"{path}:3: robots[1].x: got 9.9; expected a free place. (9.90, 7.10) is taken by"
    assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--robots", "0"], "got '0'; expected 1 to 1000"),
        (["--robots", "two"], "got 'two'; expected 1 to 1000"),
        (["--robots", "2", "--world", "w.yaml"], "not allowed with"),
        (["--ros2", ""], "--ros2: got ''; expected a router"),
    ],
)
def test_bad_arguments_are_refused(arguments, text, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize("words", [("--domain", "0"), ("--distro", "jazzy")])
def test_options_for_ros_2_without_its_router_are_refused(words, capsys):
    assert main(words) == 2
    assert "got no --ros2; expected its router" in capsys.readouterr().err


def test_all_parameters_are_listed(capsys):
    assert main(["--parameters"]) == 0
    text = capsys.readouterr().out
    for name in ("traffic_patience: 20.0", "override_time: 0.5", "range_max: 8.0"):
        assert name in text


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.parametrize(
    ("words", "name"),
    [
        ([], "robot_9/move_base"),
        (["__ns:=/robot_8"], "robot_8/move_base"),
        (["--namespace", "/"], "move_base"),
        (["--ros-args", "-r", "move_base:=drive"], "robot_9/drive"),
    ],
)
def test_the_robot_is_called_as_configuration_and_command_line_say(tmp_path, words, name):
    config = tmp_path / "network.yaml"
    config.write_text(f"namespace: robot_9\ndomain: {os.environ['SMACHPY_DOMAIN']}\n")
    command = [sys.executable, "-m", "smachpy", "robot", *words]
    environment = {**os.environ, "SMACHPY_CONFIG": str(config)}
    robot = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert robot.stdout is not None
        assert robot.stdout.readline().startswith(f"{name}: ready")
        robot.send_signal(signal.SIGINT)
        assert robot.wait(60) == 0
    finally:
        robot.kill()
        robot.wait()
        robot.stdout.close()


def test_a_rename_that_is_not_allowed_is_refused(capsys):
    assert main(["move_base:=a//b"]) == 2
    assert "'//' is not allowed" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.zenoh
def test_a_world_as_a_process():
    command = [sys.executable, "-m", "smachpy", "robot", "--world", FOLDER / "office_world.yaml"]
    world = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ.copy())
    try:
        assert world.stdout is not None
        line = world.stdout.readline()
        assert "robot_0 to robot_2, doors lab, kitchen" in line
        with Node("test") as node:
            lab = ServiceProxy("doors/lab/set", SetBool, node=node)
            lab.wait_for_service(60.0)
            assert lab(True).message == "door lab opens"
            client = SimpleActionClient("robot_2/move_base", MoveBaseAction, node=node)
            assert client.wait_for_server(60.0)
            client.send_goal_and_wait(goal_at(Pose2D(0.5, 0, 0), "base_link"))
            assert client.get_goal_status_text() == "arrived"
        world.send_signal(signal.SIGINT)
        assert world.wait(60) == 0
    finally:
        world.kill()
        world.wait()
        world.stdout.close()


def test_a_missing_package_is_named_with_its_extra(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    assert main([]) == 2
    expected = "smachpy: package 'PIL' is missing. Try: pip install 'smachpy[sim]'\n"
    assert capsys.readouterr().err == expected
