"""What recordings have of the mission's inputs."""

from __future__ import annotations

import json
from collections import Counter

import pytest

import smachpy
from actionlib_core import border
from actionlib_core.clock import VirtualClock
from actionlib_core.interfaces.move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from actionlib_core.interfaces.sensor_msgs.msg import BatteryState
from actionlib_core.interfaces.std_msgs.msg import String
from actionlib_core.interfaces.std_srvs.srv import SetBool
from smachpy import CBState, MonitorState, ServiceState, SimpleActionState, StateMachine
from smachpy.events.inputs import LARGE, Inputs
from smachpy.events.recording import Recorder, RecordingError, read_recording

GOAL = MoveBaseGoal.from_dict({"target_pose": {"header": {"frame_id": "map"}}})


def machine():
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="ERRAND")
    with sm:
        sm.add(
            "WATCH",
            MonitorState("battery", BatteryState, lambda _, state: state.percentage > 0.3),
            {"valid": "SWITCH", "invalid": "SWITCH"},
        )
        sm.add(
            "SWITCH",
            ServiceState("light", SetBool, SetBool._request_class(data=True)),
            {"succeeded": "DRIVE"},
        )
        drive = SimpleActionState(
            "move_base", MoveBaseAction, GOAL, exec_timeout=20.0, feedback_cb=lambda _, __: None
        )
        sm.add("DRIVE", drive)
    return sm


@pytest.fixture
def world(mission, action_server, service_server, topic):
    battery, robot = topic("battery", BatteryState), action_server("move_base", MoveBaseAction)
    battery.publish_at(2.0, percentage=0.9)
    battery.publish_at(4.0, percentage=0.2)
    service_server("light", SetBool).reply({"success": True, "message": "on"}, duration=0.5)
    robot.accept_late(1.5, status="aborted", duration=3.0, feedback=[{}], text="a wall")
    return mission


def recorded(world, tmp_path, sm, **options):
    with Recorder(tmp_path / "run.jsonl", sm, **options):
        world(sm)
    return read_recording(tmp_path / "run.jsonl")


def test_goals_messages_and_requests_are_recorded_with_their_times(world, tmp_path):
    recording = recorded(world, tmp_path, machine())
    told = {(one["what"], one.get("state", "")): one for one in recording.inputs}
    goal = told["goal", ""]
    assert goal["name"] == "move_base"
    assert goal["type"] == "move_base_msgs/MoveBaseAction"
    assert goal["value"]["fields"] == {"target_pose": {"header": {"frame_id": "map"}}}
    ends = [one for one in recording.inputs if one["what"] == "end"]
    assert [(one["key"], one["state"], one["text"]) for one in ends] == [
        (goal["key"], "ABORTED", "a wall")
    ]
    assert ends[0]["t"] - goal["t"] == pytest.approx(4.5)
    assert told["status", "ACTIVE"]["t"] - goal["t"] == pytest.approx(1.5)
    assert told["feedback", ""]["key"] == goal["key"]
    messages = [one for one in recording.inputs if one["what"] == "message"]
    percentages = [one["value"]["fields"]["percentage"] for one in messages]
    assert percentages == pytest.approx([0.9, 0.2])
    assert [one["t"] for one in messages] == pytest.approx([2.0, 4.0])
    assert told["request", ""]["value"]["fields"] == {"data": True}
    assert told["response", ""]["value"]["fields"] == {"success": True, "message": "on"}
    assert told["response", ""]["t"] - told["request", ""]["t"] == pytest.approx(0.5)


def test_a_cancel_and_the_death_of_a_server_are_recorded(mission, action_server, tmp_path):
    robot = action_server("move_base", MoveBaseAction)
    robot.die(after=3.0, back_after=1.0)
    sm = StateMachine(["succeeded", "aborted", "preempted"], name="DRIVES")
    with sm:
        state = SimpleActionState("move_base", MoveBaseAction, exec_timeout=20.0)
        sm.add("ONE", state, {"aborted": "TWO"})
        sm.add("TWO", SimpleActionState("move_base", MoveBaseAction, exec_timeout=20.0))
    robot.never_finish()
    recording = recorded(mission, tmp_path, sm)
    counts = Counter(one["what"] for one in recording.inputs)
    assert counts["gone"] == 1
    assert counts["server"] == 2
    assert counts["cancel"] == 1
    assert [one["state"] for one in recording.inputs if one["what"] == "end"] == [
        "LOST",
        "PREEMPTED",
    ]


def test_large_messages_are_kept_as_hash_unless_all_are_asked_for(mission, topic, tmp_path):
    def run(name, **options):
        text = topic("text", String)
        text.publish_at(1.0, data="x" * LARGE)
        sm = StateMachine(["valid", "invalid", "preempted"], name="READ")
        sm.add("READ", MonitorState("text", String, lambda _, __: False))
        with Recorder(tmp_path / name, sm, **options):
            mission(sm)
        text.close()
        found = read_recording(tmp_path / name).inputs
        return next(one["value"] for one in found if one["what"] == "message")

    outline = run("seen.jsonl")
    assert outline["bytes"] > LARGE
    assert len(outline["$hash"]) == 16
    assert run("all.jsonl", inputs="all")["fields"]["data"] == "x" * LARGE


def test_nothing_is_recorded_and_nobody_listens_if_so_asked(world, tmp_path):
    sm = machine()
    recorder = Recorder(tmp_path / "none.jsonl", sm, inputs="none")
    assert border.listeners == ()
    with recorder:
        world(sm)
    recording = read_recording(tmp_path / "none.jsonl")
    assert recording.inputs == []
    assert recording.origin is None


def test_listening_ends_with_the_recording(world, tmp_path):
    recorded(world, tmp_path, machine())
    assert border.listeners == ()


def test_secrets_are_masked(mission, topic, tmp_path):
    sm = StateMachine(["done"], input_keys=["api_key"], name="HUSH")
    sm.userdata.api_key = "sesame"
    sm.userdata.place = "door"
    with sm:
        sm.add("GO", CBState(lambda _: "done", outcomes=["done"]))
    recording = recorded(mission, tmp_path, sm, origin={"inputs": {"password": "sesame"}})
    assert "sesame" not in (tmp_path / "run.jsonl").read_text()
    assert recording.origin["userdata"]["place"] == "door"
    assert recording.origin["mission"]["inputs"]["password"] == "<secret>"


def test_results_of_once_are_masked_by_their_name(mission, tmp_path):
    sm = StateMachine(["done"], name="HUSH")
    call = {"api_key": lambda: "sesame", "list": lambda: [{"token": "sesame"}], "door": lambda: 7}
    states = [
        CBState(lambda _, key=key: [smachpy.once(key, call[key]), "done"][1], outcomes=["done"])
        for key in call
    ]
    with sm:
        sm.add("A", states[0], {"done": "B"})
        sm.add("B", states[1], {"done": "C"})
        sm.add("C", states[2])
    recording = recorded(mission, tmp_path, sm)
    assert "sesame" not in (tmp_path / "run.jsonl").read_text()
    found = {one["key"]: one for one in recording.inputs if one["what"] == "once"}
    assert (found["api_key"]["value"], found["api_key"]["hidden"]) == ("<secret>", True)
    assert found["door"]["value"] == 7


def test_the_code_is_identified(mission, tmp_path):
    recording = recorded(mission, tmp_path, machine_without_inputs())
    code = recording.origin["code"]
    assert any(name.endswith("test_inputs") for name in code["files"])
    assert not any(name.startswith("smachpy.") for name in code["files"])
    assert code["versions"]["smachpy"]
    assert len(code["hash"]) == 16


def machine_without_inputs():
    sm = StateMachine(["done"], name="SHORT")
    sm.add("GO", CBState(lambda _: "done", outcomes=["done"]))
    return sm


def test_older_recordings_have_no_inputs(mission, tmp_path):
    recorded(mission, tmp_path, machine_without_inputs())
    header, *rest = (tmp_path / "run.jsonl").read_text().splitlines(keepends=True)
    old = {key: value for key, value in json.loads(header).items() if key != "origin"}
    (tmp_path / "old.jsonl").write_text(json.dumps(old) + "\n" + "".join(rest))
    recording = read_recording(tmp_path / "old.jsonl")
    assert recording.origin is None
    assert recording.inputs == []


def test_what_does_not_fit_is_counted(virtual_clock, monkeypatch):
    monkeypatch.setattr("smachpy.events.inputs.WAITING", 100)  # in place of 100,000
    inputs = Inputs("seen", virtual_clock, "", lambda: None)
    try:
        crossing = border.Crossing("message", "t", "std_msgs/String", "1", 0.0, "n", String("x"))
        for _ in range(103):
            inputs._note(crossing)
        found = inputs.take(110)
    finally:
        inputs.close()
    assert len(found) == 101
    assert (found[-1]["what"], found[-1]["key"]) == ("lost", "3")


@pytest.fixture
def virtual_clock():
    with VirtualClock() as clock:
        yield clock


def test_another_word_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="inputs: got 'some'"):
        Recorder(tmp_path / "run.jsonl", machine(), inputs="some")
