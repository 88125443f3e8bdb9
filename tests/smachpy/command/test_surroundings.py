"""`smachpy run --time virtual`: the mission, its robot and its network in this process."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from actionlib_core.action.simple_server import SimpleActionServer
from actionlib_core.clock import VirtualClock, use_clock
from actionlib_core.config import Config, Ros2
from actionlib_core.interfaces.actionlib import msg
from actionlib_core.interfaces.nav2_msgs.action import Spin
from actionlib_core.node import Node, use_node
from actionlib_core.shutdown import Shutdown, use_shutdown
from actionlib_core.transport.memory import MemoryNetwork
from smachpy import StateMachine
from smachpy.command import main
from smachpy.command.surroundings import (
    REAL_TIME,
    Pace,
    RobotOptions,
    _Network,
    missing_on_robot,
    missing_text,
    refuse_ros2,
)
from smachpy.events.recording import read_recording
from smachpy.exceptions import MissionError

NAP = """
import signal
import smachpy

class Wait(smachpy.State):
    def __init__(self, seconds, sent):
        super().__init__(outcomes=["done", "preempted"])
        self.seconds = seconds
        self.sent = sent

    def execute(self, userdata):
        print("good night")
        if self.sent:
            signal.raise_signal(self.sent)
            while not self.preempt_requested():  # a real thread relays the signal
                self.sleep(1.0)
        self.sleep(self.seconds)
        return "preempted" if self.preempt_requested() else "done"

def mission(seconds: float = 3600.0, *, sent: int = 0):
    sm = smachpy.StateMachine(outcomes=["succeeded", "preempted"], name="NAP")
    with sm:
        sm.add("WAIT", Wait(seconds, sent), {"done": "succeeded"})
    return sm
"""

STUCK = """
import smachpy
from actionlib_core.interfaces.std_msgs.msg import String

def mission():
    sm = smachpy.StateMachine(outcomes=["succeeded", "aborted", "preempted"], name="STUCK")
    with sm:
        never = smachpy.MonitorState("nobody", String, lambda userdata, message: True)
        sm.add("WATCH", never, {"valid": "succeeded", "invalid": "aborted"})
    return sm
"""


@pytest.fixture(autouse=True)
def a_shutdown_of_its_own():
    with use_shutdown(Shutdown()):
        yield


@pytest.fixture
def nap(tmp_path):
    path = tmp_path / "nap.py"
    path.write_text(NAP)
    return str(path)


@pytest.mark.parametrize(
    ("text", "pace", "shown"),
    [
        ("real", REAL_TIME, "real"),
        ("virtual", Pace(virtual=True), "virtual"),
        ("10x", Pace(virtual=True, rate=10.0), "10x"),
        ("0.5x", Pace(virtual=True, rate=0.5), "0.5x"),
    ],
)
def test_paces(text, pace, shown):
    assert Pace.read(text) == pace
    assert str(pace) == shown


@pytest.mark.parametrize("text", ["fast", "0x", "x", "10", "-1x", "1e9x", "10 x", "nanx"])
def test_what_is_no_pace(text):
    with pytest.raises(ValueError, match="expected real, virtual, or a rate"):
        Pace.read(text)


def test_an_hour_passes_at_once(nap, capsys):
    assert main(["run", nap, "--time", "virtual"]) == 0
    out = capsys.readouterr().out
    assert "NAP: succeeded after 3600.00 s" in out


def test_a_rate(nap, capsys):
    assert main(["run", nap, "--time", "100x", "--plain", "--", "5"]) == 0
    assert "NAP: succeeded after 5.00 s" in capsys.readouterr().out


def test_the_robot_is_there_under_the_mission_s_names(capsys):
    for more in ([], ["--robot", "robot_7"], ["__ns:=/robot_7"]):
        assert main(["run", "there_and_back", "--time", "virtual", *more]) == 0, more
        assert "THERE_AND_BACK: succeeded" in capsys.readouterr().out


def test_the_robot_of_a_mission_that_names_it(capsys):
    words = ["--", "robot_0", "10.8", "7.6"]
    assert main(["run", "rp_action.gotopose", "--time", "virtual", *words]) == 0
    assert "GOTOPOSE: succeeded" in capsys.readouterr().out


def test_events_are_alone_on_standard_output(nap, capsys, tmp_path):
    assert main(["run", nap, "--time", "virtual", "--json", "--out", str(tmp_path)]) == 0
    captured = capsys.readouterr()
    lines = captured.out.splitlines()
    header, *events = map(json.loads, lines)
    assert header["format"] == "smachpy-run"
    assert [event["kind"] for event in events] == ["Started", "Entered", "Left", "Finished"]
    assert [event["seq"] for event in events] == [1, 2, 3, 4]
    assert events[-1]["outcome"] == "succeeded"
    assert "good night" in captured.err
    assert "Written: " in captured.err
    (tmp_path / "again.jsonl").write_text(captured.out)
    assert read_recording(tmp_path / "again.jsonl").record.label == "NAP"


def test_the_folder_of_a_run(nap, capsys, tmp_path):
    for seconds in ("2", "3"):  # the second run replaces the first one's files
        arguments = ["--time", "virtual", "--out", str(tmp_path / "out"), "--", seconds]
        assert main(["run", nap, *arguments]) == 0
    found = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert found == ["nap.jsonl", "nap.svg", "nap_summary.json"]
    summary = json.loads((tmp_path / "out" / "nap_summary.json").read_text())
    assert summary == {
        "mission": "nap",
        "outcome": "succeeded",
        "exit_code": 0,
        "time": "virtual",
        "seconds": 3.0,
        "states": {
            "/NAP": {"visits": 1, "seconds": 3.0, "outcomes": {"succeeded": 1}},
            "/NAP/WAIT": {"visits": 1, "seconds": 3.0, "outcomes": {"done": 1}},
        },
    }
    assert read_recording(tmp_path / "out" / "nap.jsonl").events[-1]["kind"] == "Finished"


@pytest.mark.parametrize("pace", ["virtual", "10x"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_it(nap, capsys, pace, number, code):
    words = ["--", "7", "--sent", str(int(number))]
    assert main(["run", nap, "--time", pace, "--plain", *words]) == code
    assert "NAP: preempted" in capsys.readouterr().out


TWO = """
import smachpy
from smachpy.states import Pose2D, drive_to

def mission(one: str = "robot_0/", other: str = "robot_1/"):
    sm = smachpy.Concurrence(["succeeded", "aborted", "preempted"], "aborted", name="TWO",
        outcome_map={"succeeded": {"A": "succeeded", "B": "succeeded"}})
    with sm:
        sm.add("A", drive_to(Pose2D(8.8, 7.6, 0.0), action=f"{one}move_base"))
        sm.add("B", drive_to(Pose2D(11.5, 8.0, 0.0), action=f"{other}move_base"))
    return sm
"""
ROOM = """
robots:
  - {x: 9.8, y: 7.1, yaw: 1.5708}
  - {x: 11.0, y: 7.1, yaw: 1.5708}
"""


@pytest.mark.parametrize(
    ("words", "works"),
    [
        ([], True),
        (["--", "/robot_0/", "/robot_1/"], True),
        (["--", "robot_0/", "robot_7/"], False),  # no robot of this world
        (["--robot", "robot_1"], False),  # asks for /robot_1/robot_0/move_base
    ],
)
def test_a_mission_names_the_robots_of_a_world_itself(tmp_path, capsys, words, works):
    (tmp_path / "two.py").write_text(TWO)
    (tmp_path / "room.yaml").write_text(ROOM)
    options = ["--time", "virtual", "--plain", "--world", str(tmp_path / "room.yaml")]

    code = main(["run", str(tmp_path / "two.py"), *options, *words])

    shown = capsys.readouterr()
    assert code == (0 if works else 2)
    assert ("TWO: succeeded" in shown.out) == works
    assert ("does not serve under that name" in shown.err) != works


@pytest.mark.slow
def test_it_does_so_in_real_time_too(tmp_path):
    (tmp_path / "two.py").write_text(TWO)
    (tmp_path / "room.yaml").write_text(ROOM)
    words = ["run", "two.py", "--start-robot", "--world", "room.yaml", "--plain"]

    done = subprocess.run(
        [sys.executable, "-m", "smachpy", *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=250,
    )

    assert done.returncode == 0, done.stderr
    assert "TWO: succeeded" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ["demo_action.client"],
            "the mission calls demo_action (mission_msgs/Demo_actionAction), which nobody in this",
        ),
        (["fleet"], "mission 'fleet' needs real time: its robots are processes of their own"),
        (["patrol", "move_base:=mb"], "which the simulated robot does not serve under that name"),
        (["patrol", "--view", "--control"], "--control: got --time virtual beside it"),
        (["patrol", "--ros2", "tcp/127.0.0.1:1"], "--ros2: got --time virtual beside it"),
        (["patrol", "--robot", "robot 7"], "invalid robot name: ' ' is not allowed"),
        (["patrol", "--pose", "0", "0", "0"], "Try --pose X Y YAW"),
        (["patrol", "--map", "nowhere.yaml"], "nowhere.yaml: got"),
        (["patrol", "--success", "done"], "--success done: mission 'patrol' has no such outcome"),
    ],
)
def test_what_cannot_be_had(arguments, text, capsys):
    assert main(["run", *arguments, "--time", "virtual"]) == 2
    error = capsys.readouterr().err
    assert text in error
    assert "Traceback" not in error


def test_a_current_folder_that_was_removed(nap, capsys, tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert main(["run", nap, "--time", "virtual", "--plain"]) == 2
    error = capsys.readouterr().err
    assert error == (
        "smachpy: the current folder: got one that was removed; expected one that is there. "
        "Try cd.\n"
    )


def test_a_mission_that_waits_for_somebody_outside(tmp_path, capsys):
    path = tmp_path / "stuck.py"
    path.write_text(STUCK)
    assert main(["run", str(path), "--time", "virtual"]) == 2
    error = capsys.readouterr().err
    assert "--time virtual: virtual clock: every thread waits" in error
    assert "Try --time real." in error


def test_a_mission_that_plays_in_a_world_finds_its_doors(capsys, tmp_path):
    out = tmp_path / "out"
    assert main(["run", "delivery", "--time", "virtual", "--out", str(out)]) == 1
    shown = capsys.readouterr().out
    assert "DELIVERY: brought_back" in shown  # nobody answers in virtual time
    assert "OPEN/WAIT came" in " ".join(shown.split()).replace("  ", " ")
    assert (out / "delivery_track.png").exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--robot", "robot_9"], "--robot: got 'robot_9'; expected one of ['robot_0']"),
        (["--world", "nowhere.yaml"], "nowhere.yaml: got 'No such file"),
        (["--world", "x.yaml", "--pose", "1", "2", "0"], "--world: got --map"),
    ],
)
def test_a_world_or_robot_that_is_not_there(capsys, arguments, text):
    assert main(["run", "delivery", "--time", "virtual", *arguments]) == 2
    assert text in capsys.readouterr().err


def test_another_floor_in_place_of_the_mission_s_world(capsys):
    arguments = ["--time", "virtual", "--pose", "9.8", "7.1", "0", "--", "kitchen"]
    assert main(["run", "delivery", *arguments]) == 1
    assert "DELIVERY: brought_back" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("missing", "there", "parts"),
    [
        (
            {"robot_1/move_base": "move_base"},
            ["robot_2/move_base", "charge"],
            [
                "action '/robot_1/move_base': has no server",
                "The mission calls it 'move_base'.",
                "Did you mean '/robot_2/move_base'?",
                "--namespace robot_1",
            ],
        ),
        ({"move_base": "/move_base"}, [], ["action '/move_base': has no server after 2 s"]),
        ({"pick": "pick"}, ["pick_up", "drive"], ["Did you mean '/pick_up'?", "actionlib list"]),
        (
            {"move_base": "move_base", "charge": "charge"},
            [f"robot_{i}/charge" for i in range(9)],
            ["actions '/charge', '/move_base': have no server", "'/robot_0/charge' or"],
        ),
    ],
)
def test_what_has_no_server_is_named_in_full_with_those_that_may_be_meant(missing, there, parts):
    text = missing_text(missing, there, 2.0)
    assert [part for part in parts if part not in text] == []
    assert text.count("charge'") <= 4


def test_what_has_a_server_just_now_is_not_what_may_be_meant():
    text = missing_text({"move_base": "move_base"}, ["move_base", "robot_1/move_base"], 2.0)
    assert "Did you mean '/robot_1/move_base'? Try" in text


@pytest.mark.parametrize(("needed", "names", "there"), [
    ({"move_base": "move_base_msgs/MoveBaseAction"}, ("**",), "goals of action '/move_base' would be sent to the ROS 2"),
    ({"go": "nav2_msgs/action/NavigateToPose", "x": "actionlib/TestAction"}, (), "goals of action '/go' would be sent"),
    ({"move_base": "move_base_msgs/MoveBaseAction"}, ("red/**",), ""),
    ({"unknown": "no_msgs/NoneAction"}, ("**",), ""),
])  # fmt: skip
def test_a_started_robot_beside_one_of_ros2_that_would_drive_instead(needed, names, there):
    with VirtualClock() as clock, use_clock(clock):
        config = Config(ros2=(Ros2(names=names),))
        session = MemoryNetwork(clock).session()
        with Node("mission", transport=session, clock=clock, config=config) as node, use_node(node):
            if not there:
                refuse_ros2(needed)
                return
            with pytest.raises(MissionError, match=there):
                refuse_ros2(needed)


@pytest.mark.parametrize("robot", ["ROS 1", "ROS 2", "neither"])
@pytest.mark.parametrize("served", [["spin"], []], ids=["one of two", "none"])
def test_real_robot_that_lacks_an_action_runs_the_rest_of_the_mission(capsys, robot, served):
    """A ROS 1 robot was refused, where a ROS 2 robot was warned of only."""
    with VirtualClock() as clock, use_clock(clock):
        network, config = MemoryNetwork(clock), Config(ros2=(Ros2(),) if robot == "ROS 2" else ())
        nodes = [
            Node(name, transport=network.session(), clock=clock, config=config)
            for name in ("robot", "mission")
        ]
        with nodes[0], nodes[1], use_node(nodes[1]), use_shutdown(Shutdown()):
            spec, name = (Spin, "nav2_msgs/action/Spin")
            if robot != "ROS 2":
                spec, name = msg.TestAction, "actionlib/TestAction"
            for action in served:
                SimpleActionServer(action, spec, print, auto_start=True, node=nodes[0])
            url = "http://robot:11311" if robot == "ROS 1" else ""
            options = RobotOptions(False, Path(), Path(), ros1=url)
            surroundings = _Network(options, said=False)
            surroundings.start(StateMachine(["done"]), {"spin": name, "wave": name})
            if served and robot != "neither":
                assert surroundings.wait(5.0)
                said = capsys.readouterr().err
                assert "/wave': " in said
                assert "The mission runs without." in said
            else:
                with pytest.raises(MissionError, match="/wave'"):
                    surroundings.wait(5.0)
            surroundings.close()


def test_action_missing_on_a_ros2_robot_is_told_with_what_is_there():
    with VirtualClock() as clock, use_clock(clock):
        network, config = MemoryNetwork(clock), Config(ros2=(Ros2(),))
        robot, mission = (
            Node(name, transport=network.session(), clock=clock, config=config)
            for name in ("robot", "mission")
        )
        with robot, mission, use_node(mission):
            SimpleActionServer("spin", Spin, print, auto_start=True, node=robot)
            text = missing_on_robot({"spinn": "spinn", "wait": "wait"}, 10.0)
    assert text.startswith("actions '/spinn', '/wait': no server after 10 s, neither on the ROS 2")
    assert "actions: /spin. Did you mean '/spin'?" in text
