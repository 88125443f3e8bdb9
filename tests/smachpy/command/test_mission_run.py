from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

import smachpy
from smachpy import events as ev
from smachpy.command import main
from smachpy.command.arguments import Text
from smachpy.command.mission_run import (
    RunOptions,
    build,
    good_outcomes,
)
from smachpy.command.needs import driven_robot, needed_servers
from smachpy.command.targets import Target
from smachpy.command.track_recorder import TrackRecorder
from smachpy.exceptions import MissionError
from smachpy.places.pose import Pose2D
from smachpy.states import Waypoint, goal_at


class Done(smachpy.State):
    def __init__(self):
        super().__init__(outcomes=["done"])

    def execute(self, userdata):
        return "done"


def machine(outcomes=("done",), **userdata):
    sm = smachpy.StateMachine(outcomes=list(outcomes))
    for key, value in userdata.items():
        sm.userdata[key] = value
    with sm:
        smachpy.StateMachine.add("ONE", Done(), transitions={"done": outcomes[0]})
    return sm


def target(thing):
    return Target("mine", "here:mine", "", thing)


def test_inputs_become_arguments_or_userdata():
    seen = []

    def factory(speed=1.0):
        seen.append(speed)
        return machine(places=[])

    built = build(target(factory), {"speed": 2.5, "places": ["a"]})
    assert seen == [2.5]
    assert built.userdata.places == ["a"]


def test_inputs_must_fit_the_machines_own_values():
    built = build(target(machine), {})
    assert not list(built.userdata.keys())
    own = target(lambda: machine(places=[], speed=1, name="a", thing=None))
    built = build(own, {"speed": Text("2.5"), "places": Text("[a]"), "name": Text("7")})
    assert [built.userdata[key] for key in ("speed", "places", "name")] == [2.5, ["a"], "7"]
    assert build(own, {"thing": Text("{a: 1}")}).userdata.thing == {"a": 1}
    with pytest.raises(MissionError, match=r"--input speed: got fast; expected a number, as .* 1"):
        build(own, {"speed": Text("fast")})


def test_input_keys_without_a_value_are_named():
    def factory():
        sm = smachpy.StateMachine(outcomes=["done"], input_keys=["place", "item"])
        with sm:
            smachpy.StateMachine.add("ONE", Done())
        return sm

    with pytest.raises(
        MissionError, match=r"input keys \['item'\] have no value; .* --input item="
    ):
        build(target(factory), {"place": "here"})
    build(target(factory), {"place": "here", "item": None})


def test_an_unknown_input_names_the_known_ones():
    with pytest.raises(
        MissionError, match=r"--input sped: .* expected one of \['places', 'speed'\]"
    ):
        build(target(lambda speed=1: machine(places=[])), {"sped": 1})


@pytest.mark.parametrize(
    ("value", "fitted"), [(3, 3.0), (2.5, 2.5), ("fast", None), ([1], None), (None, None)]
)
def test_inputs_must_fit_the_parameters(value, fitted):
    seen = []

    def factory(speed: float = 1.0):
        seen.append(speed)
        return machine()

    if fitted is None:
        with pytest.raises(MissionError, match=r"--input speed: got .*; expected a number"):
            build(target(factory), {"speed": value})
    else:
        build(target(factory), {"speed": value})
        assert seen == [fitted]


def test_a_text_parameter_takes_what_looks_like_a_number():
    seen = []

    def factory(path: str | Path = "x"):
        seen.append(path)
        return machine()

    build(target(factory), {"path": 3})
    assert seen == ["3"]


@pytest.mark.parametrize(
    ("outcomes", "success", "good"),
    [
        (("succeeded", "aborted", "done"), (), {"succeeded"}),
        (("all_checked", "failed", "preempted"), (), {"all_checked"}),
        (("a", "b"), ("b",), {"b"}),
        (("done", "timeout", "unreachable", "cancelled", "fail"), (), {"done"}),
        (("home", "Timed-out", "canceled by hand"), (), {"home"}),
    ],
)
def test_which_outcomes_are_a_success(outcomes, success, good):
    record = smachpy.describe(machine(outcomes))
    assert good_outcomes(record, RunOptions(success=success)) == good


def test_the_outcomes_that_a_machine_calls_good_are_a_success_unless_the_command_says_more():
    said = machine(("succeeded", "home", "lost"))
    smachpy.set_options(said, success=["home", "lost"])
    record = smachpy.describe(said)
    assert good_outcomes(record, RunOptions()) == {"home", "lost"}
    assert good_outcomes(record, RunOptions(success=("succeeded",))) == {"succeeded"}


def test_the_outcomes_that_a_mission_calls_good_are_those_of_its_machine():
    @smachpy.mission(success=["home"])
    def factory():
        return machine(("home", "lost"))

    assert smachpy.describe(build(target(factory), {})).success == ("home",)


def test_the_needed_servers_are_those_of_the_action_states():
    from smachpy_missions.patrol import patrol

    assert needed_servers(smachpy.describe(patrol())) == {
        "move_base": "move_base_msgs/MoveBaseAction",
        "charge": "mission_msgs/ChargeAction",
    }
    assert needed_servers(smachpy.describe(machine())) == {}


@pytest.mark.parametrize(
    ("names", "robot", "expected"),
    [
        ([], None, None),
        (["move_base", "dock"], None, None),
        (["r1/move_base"], None, "r1"),
        (["r1/move_base", "r1/arm/grip"], None, "r1"),
        (["r1/move_base", "lift"], None, "r1"),
        (["r1/move_base", "r2/move_base"], None, None),
        (["r1/move_base"], "/r1/", None),
        (["r1/arm/grip"], "r1", None),
        (["r2/move_base"], "r1", "r2"),
        (["r10/move_base"], "r1", "r10"),
    ],
)
def test_the_robot_that_a_mission_drives_by_its_names(names, robot, expected):
    assert driven_robot(names, robot) == expected


def test_the_recorder_names_goals_after_waypoints_else_after_states():
    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
    from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseFeedback
    from actionlib_core.interfaces.nav2_msgs.action import NavigateToPose

    recorder = TrackRecorder()
    assert not recorder.has_goals
    near, far = Pose2D(1, 2, 0), Pose2D(5, 5, 1)
    head = ("/M/DRIVE_HOME", 0.0, 0)
    recorder.on_event(ev.UserdataWritten(*head, "waypoint", Waypoint("kitchen", near)))
    recorder.on_event(ev.GoalSent(*head, "move_base", "g1", goal_at(near)))
    recorder.on_event(ev.GoalSent(*head, "move_base", "g2", goal_at(far)))
    recorder.on_event(ev.GoalSent(*head, "move_base", "g3", goal_at(far, "base_link")))
    recorder.on_event(ev.GoalSent(*head, "charge", "g4", object()))
    for x in (0.0, 0.5, 0.5, 1.0):
        pose = PoseStamped()
        pose.pose.position.x = x
        recorder.on_event(ev.GoalFeedback(*head, "move_base", "g1", MoveBaseFeedback(pose)))
    nav = NavigateToPose.Feedback()
    nav.current_pose.pose.position.x = 1.5
    recorder.on_event(ev.GoalFeedback(*head, "r/navigate_to_pose", "g5", nav))
    recorder.on_event(ev.GoalFeedback(*head, "r/other", "g6", SimpleNamespace(current_pose=1)))
    assert recorder.tracks.pop("r") == [(1.5, 0.0)]
    recorder.on_event(ev.GoalDone(*head, "move_base", "g1", "SUCCEEDED", ""))
    recorder.on_event(ev.GoalDone(*head, "move_base", "g2", "ABORTED", ""))
    assert recorder.has_goals
    marks = [(m.label, m.reached) for m in recorder._marks()]
    assert marks == [("kitchen", True), ("drive home", False)]
    assert recorder.track == [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0)]
    for i in range(5, 9):  # a state that drives to many places is no name for any of them
        goal = goal_at(Pose2D(i, 1, 0))
        recorder.on_event(ev.GoalSent("/M/GO", 0.0, 0, "move_base", f"g{i}", goal))
    assert [m.label for m in recorder._marks()] == ["kitchen", "drive home", "", "", "", ""]


def test_the_recorder_keeps_several_robots_apart(office, tmp_path):
    from actionlib_core.interfaces.geometry_msgs.msg import PoseStamped
    from smachpy_missions.interfaces import DeliverFeedback, RechargeGoal

    recorder = TrackRecorder()
    head = ("/FLEET/ROBOT/DELIVER", 0.0, 0)
    for robot in ("robot_1", "robot_10", "robot_2"):
        for x in (1.0, 2.0):
            pose = PoseStamped()
            pose.pose.position.x = x + len(robot)
            feedback = DeliverFeedback(base_position=pose)
            recorder.on_event(ev.GoalFeedback(*head, f"{robot}/deliver", "g", feedback))
    recorder.on_event(ev.GoalSent(*head, "robot_1/recharge", "g2", RechargeGoal()))
    recorder.on_event(ev.GoalDone(*head, "robot_2/deliver", "g", "LOST", "gone"))
    assert recorder.tracks["robot_10"] == [(9.0, 0.0), (10.0, 0.0)]
    assert recorder.has_goals
    recorder.draw(tmp_path / "tracks.png", office, dock=None, title="fleet: succeeded")
    assert (tmp_path / "tracks.png").read_bytes().startswith(b"\x89PNG")


STARTS_ROBOTS = """
from pathlib import Path
import smachpy


@smachpy.mission(real_time="its robots are processes", robots="start")
def mission(*, start: bool = True) -> smachpy.StateMachine:
    sm = smachpy.StateMachine(["done", "preempted"], name="TEAM")
    sm.add("WORK", smachpy.CBState(print, outcomes=["done"]))
    if start:
        sm.register_start_cb(lambda *_: Path("started").touch())
    return sm
"""


def test_a_mission_that_starts_its_robots_is_not_explored(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("team.py").write_text(STARTS_ROBOTS)
    assert main(["explore", "team.py"]) == 2
    said = capsys.readouterr().err
    assert "needs real time: its robots are processes; expected one that starts no robots" in said
    assert "Try -i start=false." in said
    assert not Path("started").exists()
    assert main(["explore", "team.py", "-i", "start=false", "--jobs", "1"]) == 0
