"""Robots in MCAP files: what 3D views read."""

from __future__ import annotations

import base64
import json
import math
import zlib
from pathlib import Path

import pytest
from mcap.reader import make_reader

from actionlib_core.interfaces import define_action, get_message
from smachpy.command import main
from smachpy.events import recording
from smachpy.events.introspection import StateRecord, TransitionRecord
from smachpy.events.recording import interface_texts, read_recording
from smachpy_viz.runs.mcap import write_mcap

KNOWN = {  # md5 sums of ROS Noetic, by which Foxglove and rviz know the types
    "tf2_msgs/TFMessage": "94810edda583a504dfda3829e70d7eec",
    "geometry_msgs/PoseStamped": "d3812c3cbc69362b77dc0b19b345f8f5",
    "nav_msgs/OccupancyGrid": "3381f2d731d4076ec5c71b0759edbe4e",
    "nav_msgs/Path": "6227e2b7e9cce15051f669a5e197bbf7",
    "sensor_msgs/LaserScan": "90c7ef2dc6895d81024acba2ac42f369",
    "std_msgs/Float64": "fdb28210bfa9d7c91146260178d9a584",
    "std_msgs/String": "992ce8a1687cec8c8bd883ec73ca41d1",
    "visualization_msgs/MarkerArray": "d155b9ce5188fbaf89745847fd5882d7",
}


def state(path, **more):
    return StateRecord(path, path.rpartition("/")[2], "state", "State", ("done",), **more)


MACHINE = StateRecord(
    "/JOB", "JOB", "machine", "StateMachine", ("done",),
    children=(state("/JOB/A"), state("/JOB/B")), initial=("A",),
    transitions=(TransitionRecord("A", "done", "B", False, False),),
)  # fmt: skip
CELLS = base64.b64encode(zlib.compress(bytes([0, 1, 2, 0, 1, 2]))).decode()
SEEN = [
    {"what": "map", "resolution": 0.5, "width": 3, "height": 2, "origin": [-1, -2, 0],
     "cells": CELLS},
    {"what": "pose", "at": [1.0, 2.0, math.pi / 2]},
    {"what": "scan", "at": [1.0, 2.0, 0.0], "first": -1.0, "step": 1.0, "ranges": [100, -1, 50]},
    {"what": "plan", "points": [[1.0, 2.0], [3.0, 4.0]]},
    {"what": "value", "name": "battery", "value": 81.5, "unit": "%"},
]  # fmt: skip
EVENTS = [
    {"kind": "Started", "path": "/JOB", "t": 0.0, "initial": ["A"]},
    {"kind": "Entered", "path": "/JOB/A", "t": 0.0},
    {"kind": "UserdataWritten", "path": "/JOB/A", "t": 0.0, "key": "level", "value": 3},
    {"kind": "Left", "path": "/JOB/A", "t": 0.0, "outcome": "done"},
    {"kind": "Entered", "path": "/JOB/B", "t": 0.0},
]


def goal_sent(kind, fields):
    goal = {"$msg": kind, "fields": fields}
    return {
        "kind": "GoalSent", "path": "/JOB/A", "t": 0.0, "action": "weld", "goal_id": "g", "goal": goal,
    }  # fmt: skip


def exported(tmp_path: Path, observed):
    """Schema, topic and message of everything in the file; and the recording's path."""
    header = {
        "format": "smachpy-run", "version": 1, "stamp_ns": 10**9,
        "machine": json.loads(MACHINE.to_json()), "base": None,
    }  # fmt: skip
    records = [{**e, "stamp_ns": 10**9 + i, "seq": i + 1} for i, e in enumerate(EVENTS)]
    records += [
        {"kind": "Observed", "path": "", "stamp_ns": 2 * 10**9 + i, "robot": "", **one}
        for i, one in enumerate(observed)
    ]
    file = tmp_path / "run.jsonl"
    file.write_text("".join(json.dumps(line) + "\n" for line in [header, *records]))
    write_mcap(read_recording(file), tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as stream:
        return [
            (schema, channel.topic, get_message(schema.name).from_bytes(message.data))
            for schema, channel, message in make_reader(stream).iter_messages()
        ]


def test_a_large_recording_is_exported_record_by_record(tmp_path, monkeypatch):
    whole = exported(tmp_path, [*SEEN, {"what": "pose", "x": 2.0}])  # the last one has a wrong form
    monkeypatch.setattr(recording, "STREAMED", 10)
    monkeypatch.setattr(recording, "_read", None)  # nothing is read whole
    file = tmp_path / "streamed.mcap"
    assert main(["runs", "export", str(tmp_path / "run.jsonl"), "-o", str(file)]) == 0
    assert file.read_bytes() == (tmp_path / "run.mcap").read_bytes()
    assert "/pose" in {topic for _, topic, _ in whole}


def test_a_robot_stands_on_its_map_with_scan_and_plan(tmp_path):
    found = exported(tmp_path, SEEN)
    by_topic = {topic: message for _, topic, message in found}
    for schema, _, message in found:
        if schema.name in KNOWN:
            assert schema.encoding == "ros1msg"
            assert message._md5sum == KNOWN[schema.name]
    assert KNOWN.keys() <= {schema.name for schema, _, _ in found}

    grid = by_topic["/map"]
    assert grid.header.frame_id == "map"
    assert list(grid.data) == [0, 100, -1, 0, 100, -1]
    assert (grid.info.width, grid.info.height, grid.info.origin.position.y) == (3, 2, -2.0)

    frames = [m.transforms[0] for _, topic, m in found if topic == "/tf"]
    assert [one.child_frame_id for one in frames] == ["base_link", "scanner"]
    assert {one.header.frame_id for one in frames} == {"map"}
    turn = frames[0].transform.rotation
    assert 2 * math.atan2(turn.z, turn.w) == pytest.approx(math.pi / 2)
    assert by_topic["/pose"].pose.position.y == 2.0

    scan = by_topic["/scan"]
    assert scan.header.frame_id == "scanner"
    assert list(scan.ranges) == [1.0, math.inf, 0.5]
    assert scan.angle_max == pytest.approx(1.0)
    assert [p.pose.position.x for p in by_topic["/plan"].poses] == [1.0, 3.0]
    assert by_topic["/battery"].data == 81.5


def test_panels_of_states_and_plots_have_scalar_topics(tmp_path):
    found = exported(tmp_path, [])
    assert [m.data for _, topic, m in found if topic == "/JOB/state"] == ["A", "", "B"]
    assert [m.data for _, topic, m in found if topic == "/JOB/userdata/level"] == [3.0]
    texts = [m.markers[0].text for _, topic, m in found if topic == "/JOB/markers"]
    assert texts[-1] == "B"


@pytest.mark.parametrize(
    "broken",
    [
        {"what": "pose", "at": ["x", None, 0]},
        {"what": "pose"},
        {"what": "map", "resolution": 1, "width": 3, "height": 3, "origin": [0, 0, 0],
         "cells": CELLS},
        {"what": "map", "resolution": 1, "width": 3, "height": 2, "origin": [0, 0, 0],
         "cells": "!"},
        {"what": "scan", "at": [0, 0, 0], "first": "nan", "step": [], "ranges": 7},
        {"what": "value", "name": "battery", "value": "full"},
        {"what": ["?"]},
    ],
)  # fmt: skip
def test_what_has_another_shape_is_left_out_and_named(tmp_path, caplog, broken):
    found = exported(tmp_path, [broken, SEEN[1]])
    assert [topic for _, topic, _ in found if topic in {"/pose", "/map", "/scan"}] == ["/pose"]
    if broken["what"] != ["?"]:
        assert "left out" in caplog.text


def test_own_types_come_from_the_recording(tmp_path):
    line = "=" * 80
    texts = {
        "elsewhere_msgs/WeldGoal": f"Seam[] seams\n\n{line}\nMSG: elsewhere_msgs/Seam\nfloat64 long\n",
        "elsewhere_msgs/WeldResult": "bool ok\n",
        "elsewhere_msgs/WeldFeedback": "",
        "elsewhere_msgs/BadGoal": "no such line\x00 at all",
        "elsewhere_msgs/BadResult": "",
        "elsewhere_msgs/BadFeedback": "",
        "elsewhere_msgs/Alone": "",
    }
    seam = {"$msg": "elsewhere_msgs/Seam", "fields": {"long": 1.5}}
    found = exported(
        tmp_path,
        [
            {"kind": "Types", "definitions": texts},
            {"kind": "Types", "definitions": ["?"]},
            goal_sent("elsewhere_msgs/WeldGoal", {"seams": [seam]}),
            goal_sent("elsewhere_msgs/BadGoal", {}),
        ],
    )
    goals = [(schema.name, m) for schema, topic, m in found if topic == "/weld/goal"]
    assert [name for name, _ in goals] == ["elsewhere_msgs/WeldActionGoal"]
    assert goals[0][1].goal.seams[0].long == 1.5


def test_definitions_of_own_types_are_recorded_and_those_of_ros_are_not():
    define_action("at_home_msgs/Wash", "geometry_msgs/Point at\n---\n---\nfloat32 part\n")
    texts = interface_texts("at_home_msgs/WashGoal")
    assert texts.keys() == {f"at_home_msgs/Wash{part}" for part in ("Goal", "Result", "Feedback")}
    assert "MSG: geometry_msgs/Point" in texts["at_home_msgs/WashGoal"]
    for name in ("move_base_msgs/MoveBaseGoal", "nowhere_msgs/XGoal", "at_home_msgs/Wash", ""):
        assert interface_texts(name) == {}
